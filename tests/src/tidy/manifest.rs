//! Imports point down, and a heavy dependency has one home: read from the Cargo manifests.

/// One dependency line of a manifest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dependency {
    /// Name of the package (`package = "…"` undone).
    pub name: String,
    /// Only for tests and benches: a development dependency, or an optional one whose folder is in `tests`.
    pub dev: bool,
}

/// What the checks need of a manifest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Manifest {
    /// Folder of the crate, from the top: `framework/spatial`.
    pub folder: String,
    /// Package name.
    pub package: String,
    /// All dependencies.
    pub dependencies: Vec<Dependency>,
}

/// Reads a manifest: tables `[dependencies]`, `[dev-dependencies]`, `[build-dependencies]`,
/// `[target.….dependencies]` and `[dependencies.name]`, one entry a line.
pub fn parse(folder: &str, text: &str) -> Manifest {
    let mut manifest = Manifest { folder: folder.into(), ..Manifest::default() };
    let mut table = String::new();
    for line in text.lines().map(|l| l.trim_start().trim_end()) {
        if let Some(head) = line.strip_prefix('[') {
            table = head.split(']').next().unwrap_or_default().to_string();
            if let Some((parent, name)) = table.rsplit_once('.')
                && let Some(dev) = kind(parent)
            {
                manifest.dependencies.push(Dependency { name: unquoted(name), dev });
            }
            continue;
        }
        let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
            continue;
        };
        if table == "package" && key.trim() == "name" {
            manifest.package = unquoted(value);
        }
        if let Some(dev) = kind(&table) {
            let key = key.trim().split('.').next().unwrap_or_default();
            let renamed = value
                .split_once("package")
                .and_then(|(_, rest)| rest.trim_start().strip_prefix('='))
                .and_then(|rest| rest.split('"').nth(1));
            let name = unquoted(renamed.unwrap_or(key));
            // An optional dependency on a folder for tests is only built on request, so it counts
            // like one for tests.
            let dev = dev || (value.contains("optional = true") && value.contains("/tests/"));
            manifest.dependencies.push(Dependency { name, dev });
        }
    }
    manifest
}

/// `Some(dev)` when the table lists dependencies.
fn kind(table: &str) -> Option<bool> {
    match table.rsplit('.').next() {
        _ if table.starts_with("workspace") => None,
        Some("dependencies" | "build-dependencies") => Some(false),
        Some("dev-dependencies") => Some(true),
        _ => None,
    }
}

fn unquoted(text: &str) -> String {
    text.trim().trim_matches('"').to_string()
}

/// Floors, in tenths so that the façade finds its place above the floors that it re-exports.
const FLOORS: [(&str, u32); 28] = [
    ("framework/derive", 0),
    ("framework/maths", 0),
    ("framework/names", 0),
    ("framework/spatial", 10),
    ("framework/multibody", 20),
    ("framework/world", 20),
    ("framework/dynamics", 30),
    ("framework/operators", 35),
    ("framework/formats", 30),
    ("framework/integrate", 30),
    ("framework/solvers", 40),
    ("framework/collision", 40),
    ("framework/embedded", 50),
    ("framework/embedded_c", 55),
    ("framework/render", 55),
    ("framework/runtime", 50),
    ("framework/surroundings", 52),
    ("framework/plant", 55),
    ("framework/assembly", 60),
    ("framework/record", 60),
    ("framework/viz", 60),
    ("framework/runner", 63),
    ("framework/campaign", 64),
    ("framework/live", 64),
    ("framework/fmi", 64),
    ("framework/program", 65),
    ("framework", 85),
    ("assemblies", 80),
];

/// The floor of a crate's folder, in tenths.
pub fn floor(folder: &str) -> Option<u32> {
    if let Some((_, floor)) = FLOORS.iter().find(|(f, _)| *f == folder) {
        return Some(*floor);
    }
    match folder.split('/').next() {
        Some("components") => Some(70),
        Some("sims") => Some(90),
        Some("tests") => Some(100),
        _ => None,
    }
}

/// Crates of these floors do not import each other.
const NO_SIBLINGS: [u32; 2] = [60, 70];

/// Arrows that point up or sideways. `allowed_up` lists (package, dependency) pairs that tests may use.
pub fn arrows(all: &[Manifest], allowed_up: &[(&str, &str)]) -> Vec<String> {
    let mut found = Vec::new();
    for m in all {
        let Some(own) = floor(&m.folder) else {
            found.push(format!("`{}` is on no floor: add it to the list in tidy", m.folder));
            continue;
        };
        for d in &m.dependencies {
            let Some(other) = all.iter().find(|o| o.package == d.name) else { continue };
            let Some(theirs) = floor(&other.folder) else { continue };
            let up = theirs > own || (theirs == own && NO_SIBLINGS.contains(&own));
            let listed = allowed_up.contains(&(m.package.as_str(), d.name.as_str()));
            if up && !(d.dev && listed) {
                let what = if theirs > own { "up" } else { "to a sibling" };
                let remedy = if d.dev { "list it in tidy, or remove it" } else { "remove it" };
                found.push(format!(
                    "`{}` ({}) imports `{}` ({}): an arrow {what}; {remedy}",
                    m.package, m.folder, d.name, other.folder
                ));
            }
        }
    }
    found
}

/// Heavy dependencies and the only folder that may name each; a trailing `*` matches a prefix.
pub const HOMES: [(&str, &str); 27] = [
    ("libm", "framework/maths"),
    ("cbindgen", "framework/embedded_c"),
    ("libloading", "framework/fmi"),
    ("zip", "framework/fmi"),
    ("nalgebra", "framework/spatial"),
    ("petgraph", "framework/runtime"),
    ("sofars", "framework/world"),
    ("rayon", "framework/dynamics"),
    ("roxmltree", "framework/formats"),
    ("ron", "framework/assembly"),
    ("mcap", "framework/record"),
    ("prost", "framework/record"),
    ("prost-types", "framework/record"),
    ("foxglove", "framework/record"),
    ("plotters", "framework/record"),
    ("re_sdk", "framework/viz"),
    ("re_log_encoding", "framework/viz"),
    ("re_sdk_types", "framework/viz"),
    ("parry*", "framework/collision"),
    ("parquet", "framework/record"),
    ("statrs", "framework/campaign"),
    ("sobol_burley", "framework/campaign"),
    ("clarabel", "components/flight"),
    ("clap*", "framework/program"),
    ("indicatif", "framework/program"),
    ("pyo3", "sims/python"),
    ("numpy", "sims/python"),
];

/// Heavy dependencies outside their home, tests included.
pub fn homes(all: &[Manifest]) -> Vec<String> {
    let mut found = Vec::new();
    // `tests/features` does not contain code: it names crates only to give them the same features
    // everywhere.
    for m in all.iter().filter(|m| m.folder != "tests/features") {
        for d in &m.dependencies {
            let home = HOMES.iter().find(|(name, _)| match name.strip_suffix('*') {
                Some(prefix) => d.name.starts_with(prefix),
                None => d.name == *name,
            });
            if let Some((_, home)) = home.filter(|(_, home)| *home != m.folder) {
                found.push(format!(
                    "`{}` names `{}`, whose home is {home}: use what {home} re-exports",
                    m.folder, d.name
                ));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made_up(folder: &str, package: &str, rest: &str) -> Manifest {
        parse(folder, &format!("[package]\nname = \"{package}\"\n{rest}"))
    }

    #[test]
    fn manifests_are_read() {
        let m = parse(
            "components/x",
            "[package]\nname = \"x\" \nversion.workspace = true\n[dependencies]\n# a = 1\na.workspace = true\n\
             b = { version = \"1\", package = \"bee\" }\nf = { path = \"../../tests/f\", optional = true }\n[target.'cfg(unix)'.dependencies]\nc = \"1\"\n\
             [dev-dependencies]\nd = \"1\"\n[dependencies.e]\nversion = \"1\"\n[lints]\nworkspace = true",
        );
        let names: Vec<(&str, bool)> =
            m.dependencies.iter().map(|d| (d.name.as_str(), d.dev)).collect();
        assert_eq!(m.package, "x");
        assert_eq!(
            names,
            [("a", false), ("bee", false), ("f", true), ("c", false), ("d", true), ("e", false),]
        );
    }

    #[test]
    fn arrows_up_and_to_siblings_are_found() {
        let all = [
            made_up("framework/spatial", "s", "[dependencies]\nr.workspace = true"),
            made_up("framework/runtime", "r", "[dependencies]\ns.workspace = true"),
            made_up("framework/record", "rec", "[dependencies]\nviz.workspace = true"),
            made_up("framework/viz", "viz", "[dev-dependencies]\nc.workspace = true"),
            made_up("components/a", "a", "[dependencies]\nc.workspace = true"),
            made_up("components/c", "c", "[dev-dependencies]\na.workspace = true"),
            made_up("loft", "l", ""),
        ];
        let found = arrows(&all, &[("viz", "c")]);
        let starts =
            ["`s` (framework/spatial) imports `r`", "`rec` ", "`a` ", "`c` ", "`loft` is on no"];
        assert_eq!(found.len(), starts.len(), "{found:#?}");
        for (line, start) in found.iter().zip(starts) {
            assert!(line.starts_with(start), "{line}");
        }
        assert_eq!(arrows(&all, &[]).len(), starts.len() + 1, "an unlisted test arrow is found");
    }

    #[test]
    fn heavy_dependencies_away_from_home_are_found() {
        let all = [
            made_up("framework/spatial", "s", "[dependencies]\nnalgebra.workspace = true"),
            made_up("components/a", "a", "[dev-dependencies]\nparry3d-f64 = \"1\""),
            made_up(
                "framework/program",
                "p",
                "[dependencies]\nclap.workspace = true\nre_sdk = \"1\"",
            ),
        ];
        let found = homes(&all);
        assert_eq!(found.len(), 2, "{found:#?}");
        assert!(found[0].contains("framework/collision") && found[1].contains("framework/viz"));
    }
}
