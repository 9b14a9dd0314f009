//! Patterns over paths of variables: `*` stands for one segment or a part of it, `**` for any number of segments. Dots and slashes both end a
//! segment, so `Rover.**` includes the bodies of `Rover`.

/// Returns whether a pattern matches a whole path. O(pattern × path) for any number of stars.
pub fn path_matches(pattern: &str, path: &str) -> bool {
    // Most paths differ from a pattern before its first star.
    let star = pattern.find('*').unwrap_or(pattern.len());
    let plain = pattern[..star].trim_end_matches(['.', '/']);
    let dot = |b: u8| if b == b'/' { b'.' } else { b };
    let begins =
        path.len() >= plain.len() && plain.bytes().zip(path.bytes()).all(|(a, b)| dot(a) == dot(b));
    if !begins {
        return false;
    }
    let path: Vec<&str> = path.split(['.', '/']).collect();
    // If now[j] is set, the processed part of the pattern matches the first j segments.
    let mut now = vec![false; path.len() + 1];
    now[0] = true;
    for segment in pattern.split(['.', '/']) {
        let mut next = vec![false; path.len() + 1];
        if segment == "**" {
            let mut open = false;
            for (to, from) in next.iter_mut().zip(&now) {
                open |= from;
                *to = open;
            }
        } else {
            for (j, name) in path.iter().enumerate() {
                next[j + 1] = now[j] && segment_matches(segment, name);
            }
        }
        now = next;
    }
    now[path.len()]
}

/// Returns whether a pattern of one segment matches a name: `Wheel*`, `*`, `Motor`. O(pattern × name).
pub fn segment_matches(pattern: &str, name: &str) -> bool {
    if !pattern.contains('*') {
        return pattern == name;
    }
    let (pattern, name): (Vec<char>, Vec<char>) =
        (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // Position of the last star in the pattern, and the position in the name where its match ends.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        if pattern.get(p) == Some(&'*') {
            star = Some((p, n));
            p += 1;
        } else if pattern.get(p) == Some(&name[n]) {
            (p, n) = (p + 1, n + 1);
        } else if let Some((at, taken)) = star {
            star = Some((at, taken + 1));
            (p, n) = (at + 1, taken + 1);
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_names_and_for_any_number_of_them() {
        for (pattern, path, expected) in [
            ("Rover.*.torque", "Rover.Motor.torque", true),
            ("Rover.*.torque", "Rover.Wheels.Motor.torque", false),
            ("Rover.**.torque", "Rover.Wheels.Motor.torque", true),
            ("Rover.**.torque", "Rover.torque", true),
            ("**", "a.b", true),
            ("*", "a.b", false),
            ("*", "ab", true),
            ("a*", "ab.c", false),
            ("Rover.**", "Rover/chassis.angle", true),
            ("", "", true),
            ("", "a", false),
            ("Wheel[*].x", "Wheel[3].x", true),
            ("*l*2", "Wheel12", true),
            ("*l*3", "Wheel12", false),
            ("ä*", "äb", true),
            ("Rover.**", "Rover", true),
            ("Rover.**", "Rove", false),
            ("Rover.*", "Rover", false),
            ("Rover.Wheel*.x", "Rover/Wheel1/x", true),
            ("Rover.Wheel*.x", "Rover.Whee.x", false),
            ("a.b", "a.bc", false),
            ("a.b", "a/b", true),
            ("a.", "a", false),
            ("a..*", "a.b", false),
            ("a..*", "a..b", true),
        ] {
            assert_eq!(path_matches(pattern, path), expected, "{pattern} on {path}");
        }
    }

    #[test]
    fn many_stars_do_not_take_long() {
        let pattern = "*a".repeat(200) + "b";
        assert!(!segment_matches(&pattern, &"a".repeat(2000)));
        let pattern = "**.".repeat(200) + "b";
        assert!(!path_matches(&pattern, &"a.".repeat(2000)));
    }
}
