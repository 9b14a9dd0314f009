//! The READMEs of the task simulations: checks each number to its last digit.

use crate::common;

/// Metrics of a run, and sentences of the README with `#` in place of each number.
fn says(task: &str, set: &[&str], sentences: &[(&str, &str)]) {
    let metrics = common::metrics(task, set).unwrap_or_else(|e| panic!("{task} {set:?}: {e}"));
    println!("{task} {set:?}: {metrics:#.4?}");
    let page = linkwork_tests::root().join("sims").join(task).join("README.md");
    let page = std::fs::read_to_string(page).unwrap();
    // Lines of the README may break anywhere.
    let page = page.split_whitespace().collect::<Vec<&str>>().join(" ");
    let mut wrong = Vec::new();
    for (metric, sentence) in sentences {
        let value = metrics.get(*metric).unwrap_or_else(|| panic!("{task}: no metric `{metric}`"));
        let (before, after) = sentence.split_once('#').unwrap();
        // The words before and after a number must match at the same place.
        let between = |(at, _): (usize, &str)| {
            let rest = &page[at + before.len()..];
            let number = &rest[..rest.find(after)?];
            Some((number, number.parse::<f64>().ok()?))
        };
        let Some((number, said)) = page.match_indices(before).find_map(between) else {
            wrong.push(format!("the page does not say `{sentence}`, which is {value:.4}"));
            continue;
        };
        let digits = number.split_once('.').map_or(0, |n| n.1.len() as i32);
        // The tolerance is half of the last digit, and a small share for rounding at the edge.
        if !((said - value.abs()).abs() <= 0.5000001 * 10f64.powi(-digits)) {
            wrong.push(format!("`{metric}` is {value:.4}, the page says {number} in `{sentence}`"));
        }
    }
    assert!(wrong.is_empty(), "{task} {set:?}:\n{}", wrong.join("\n"));
}

#[test]
fn push_button_says_what_it_does() {
    let of = [
        ("travel of the button", "the button moves # mm"),
        ("largest force on the finger", "at most # N on the finger"),
    ];
    says("push_button", &[], &of);
}

#[test]
fn drill_says_what_it_does() {
    let of = [
        ("depth of the hole", "the hole is # mm deep"),
        ("how far the point came", "the point comes to # mm"),
        ("largest thrust", "at most # N and"),
        ("largest torque of the bit", "N and # N m"),
    ];
    says("drill", &[], &of);
}

#[test]
fn hang_up_phone_says_what_it_does() {
    let of = [
        ("largest force on the handset", "touches down with # N"),
        ("force on the handset at the end", "equals its weight, # N"),
        ("height of the handset at the end", "its centre is # mm high"),
    ];
    says("hang_up_phone", &[], &of);
}

#[test]
fn key_and_door_says_what_it_does() {
    let of = [
        ("key turned", "the key turns by #°"),
        ("door opened", "the door opens by #°"),
        ("push of the tip, largest", "at most # N of push"),
    ];
    says("key_and_door", &[], &of);
}

#[test]
fn cut_wire_says_what_it_does() {
    let of = [
        ("largest force of the edges", "the edges meet the wire with # N"),
        ("force of the compliant tip, largest", "the compliant tip pushes with at most # N"),
    ];
    says("cut_wire", &[], &of);
    let of = [
        ("largest force of the edges", "If `grip` is 38, the edges press with # N only"),
        ("share of the wire that is cut", "that is cut` stays #."),
    ];
    says("cut_wire", &["grip=38"], &of);
}

#[test]
fn dual_arm_carry_says_what_it_does() {
    let of = [
        ("largest squeeze", "squeeze with at most # N"),
        ("friction that the palms need", "that they need a friction of #,"),
        ("largest share of what a joint can do", "it reaches # of its effort limit"),
        ("force on the beam at the end", "equals its weight, # N"),
        ("height of the beam at the end", "its centre is # mm high"),
    ];
    says("dual_arm_carry", &[], &of);
}

#[test]
fn tyre_change_says_what_it_does() {
    let of = [
        ("largest squeeze", "squeeze with at most # N"),
        ("friction that the palms need", "The controller reports a required friction of #;"),
        (
            "largest share of what a joint can do",
            "The most loaded joint reaches # of its effort limit",
        ),
        ("largest force on the hub", "the hub is pushed with # N at the touch"),
        ("nut 1 beside its stud", "first nut ends # mm to the side"),
        ("nut 1 before its stud", "side of its stud and # mm in front"),
    ];
    says("tyre_change", &[], &of);
}

#[test]
fn legged_stand_says_what_it_does() {
    let of = [
        ("least distance inside the polygon of the feet", "never nearer than # mm to the edge"),
        ("largest tilt", "The trunk tilts by #°"),
        ("height of the centre of mass at the end", "stands # mm high"),
        ("largest error of the centre of mass", "never farther than # mm from its target"),
    ];
    says("legged_stand", &[], &of);
    let of = [(
        "height of the centre of mass at the end",
        "than the controller assumes it stands # mm high",
    )];
    says("legged_stand", &["mass=1.6", "mass_believed=1.2"], &of);
}
