//! The repository's rules, checked on this repository.
use linkwork_tests::root;
use linkwork_tests::tidy::words::Kind;
use linkwork_tests::tidy::{docs, layers, manifest, sources, words};
use std::path::{Path, PathBuf};

/// Test dependencies on higher layers, each with its reason.
const ALLOWED_UP: [(&str, &str); 4] = [
    // Closed forms of motions are compared with integrated ones.
    ("linkwork-dynamics", "linkwork-solvers"),
    // The operators are compared with the kernels on the random trees of these tests.
    ("linkwork-dynamics", "linkwork-operators"),
    // Kinds of services are tested with terrain, gravity and worlds.
    ("linkwork-runtime", "linkwork-surroundings"),
    // The dependency is optional, and only for the features of third-party crates: the tested wheel uses
    // what was compiled before.
    ("linkwork-python-module", "linkwork-features"),
];

/// Number of phrases of `tidy::words` in the repository. Lower it when it falls.
const PHRASES_MOST: [(Kind, usize); 3] =
    [(Kind::Page, 3), (Kind::Documentation, 490), (Kind::Comment, 4)];

const FOLDERS: [&str; 5] = ["framework", "components", "assemblies", "sims", "tests"];

/// Returns all files below a folder, sorted, without build output and hidden folders.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut entries: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy().to_string();
        if name.starts_with('.') || ["target", "runs", "__pycache__"].contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found
}

fn all_files() -> Vec<(String, PathBuf)> {
    FOLDERS
        .iter()
        .flat_map(|f| files(&root().join(f)))
        .map(|p| (p.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/"), p))
        .collect()
}

fn manifests() -> Vec<manifest::Manifest> {
    let all: Vec<_> = all_files()
        .into_iter()
        .filter(|(name, _)| name.ends_with("/Cargo.toml"))
        .map(|(name, path)| {
            let folder = name.trim_end_matches("/Cargo.toml");
            manifest::parse(folder, &std::fs::read_to_string(path).unwrap())
        })
        .collect();
    assert!(all.len() > 15, "only {} manifests found", all.len());
    all
}

fn none(found: Vec<String>) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn imports_point_down() {
    none(manifest::arrows(&manifests(), &ALLOWED_UP));
}

#[test]
fn heavy_dependencies_stay_at_home() {
    none(manifest::homes(&manifests()));
}

#[test]
fn every_crate_is_a_member_of_the_workspace() {
    let workspace = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let lost =
        manifests().into_iter().filter(|m| !workspace.contains(&format!("\"{}\"", m.folder)));
    none(lost.map(|m| format!("`{}` is not in the workspace", m.folder)).collect());
}

#[test]
fn source_files_have_headers_and_nothing_unfinished() {
    let source = |name: &str| {
        [".rs", ".py", ".sh", ".cpp", ".toml", ".ron"].iter().any(|e| name.ends_with(e))
    };
    let found = all_files()
        .into_iter()
        .filter(|(name, _)| source(name))
        .filter_map(|(name, path)| Some((name, std::fs::read_to_string(path).ok()?)))
        .flat_map(|(name, text)| sources::file(&name, &text))
        .collect();
    none(found);
}

#[test]
fn every_file_of_tests_is_compiled() {
    let texts: Vec<(String, String)> = (all_files().into_iter())
        .filter(|(name, _)| name.ends_with(".rs"))
        .map(|(name, path)| (name, std::fs::read_to_string(path).unwrap()))
        .collect();
    let mut found = Vec::new();
    let mut programs = 0;
    for manifest in manifests() {
        let folder = format!("{}/tests/", manifest.folder);
        let files: Vec<(&str, &str)> = (texts.iter())
            .filter_map(|(name, text)| Some((name.strip_prefix(&folder)?, text.as_str())))
            .collect();
        // The manifest names a program.
        let text =
            std::fs::read_to_string(root().join(&manifest.folder).join("Cargo.toml")).unwrap();
        let programs_of_their_own = |name: &str| text.contains(&format!("path = \"tests/{name}\""));
        let files: Vec<_> = (files.into_iter())
            .filter(|(name, _)| *name == "main.rs" || !programs_of_their_own(name))
            .collect();
        let own = files.iter().filter(|(name, _)| !name.contains('/')).count();
        if files.iter().any(|(name, _)| *name == "main.rs") {
            programs += 1;
            found.extend(sources::unnamed(&files).iter().map(|f| format!("{folder}{f}")));
        } else if own > 1 {
            found.push(format!("{folder}: {own} programs; name the files in one `main.rs`"));
        }
    }
    assert!(programs > 15, "only {programs} programs of tests found");
    none(found);
}

#[test]
fn the_top_level_holds_concepts() {
    let names: Vec<String> = std::fs::read_dir(root())
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().to_string())
        .collect();
    let ignored = std::fs::read_to_string(root().join(".gitignore")).unwrap();
    none(sources::top_level(names.iter().map(String::as_str), &ignored));
}

#[test]
fn documents_name_paths_that_exist() {
    let top = ["README.md"].map(|n| (n.to_string(), root().join(n)));
    let pages = all_files().into_iter().filter(|(name, _)| {
        let folders = ["framework/", "sims/", "tests/benches/"];
        name.ends_with(".md") && folders.iter().any(|f| name.starts_with(f))
    });
    // Paths are relative to the top, or to the document's own folder.
    let found = pages
        .chain(top.into_iter().filter(|(_, p)| p.exists()))
        .flat_map(|(name, page)| {
            let folder = page.parent().unwrap().to_path_buf();
            let read = |path: &str| {
                let found = [&root(), &folder].map(|f| f.join(path));
                let found = found.into_iter().find(|p| p.exists())?;
                Some(if found.is_dir() {
                    String::new()
                } else {
                    std::fs::read_to_string(found).unwrap()
                })
            };
            docs::missing(&name, &std::fs::read_to_string(page).unwrap(), &read)
        })
        .collect();
    none(found);
}

/// The workspace lints forbid `unsafe`. The crates that call foreign code, and the one that defines functions of C, have their own lints, which
/// require the reason of each block.
/// reason of each block.
#[test]
fn unsafe_code_has_three_homes() {
    let manifests = all_files().into_iter().filter(|(name, _)| name.ends_with("/Cargo.toml"));
    let own: Vec<(String, String)> = manifests
        .filter(|(name, _)| !name.starts_with("tests/fuzz/"))
        .map(|(name, path)| (name, std::fs::read_to_string(path).unwrap()))
        .filter(|(_, text)| !text.contains("[lints]\nworkspace = true"))
        .collect();
    let names: Vec<&str> = own.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "framework/embedded_c/Cargo.toml",
            "framework/fmi/Cargo.toml",
            "framework/maths/Cargo.toml"
        ]
    );
    for (name, text) in &own {
        let lints = ["unsafe_op_in_unsafe_fn", "undocumented_unsafe_blocks"];
        assert!(lints.iter().all(|l| text.contains(&format!("{l} = \"deny\""))), "{name}");
    }
}

/// The runtime schedules parts and blocks. The mechanism is a part in the crate `framework/plant`, and the surroundings of machines are services in
/// `framework/surroundings`.
#[test]
fn the_runtime_names_no_mechanism() {
    const DOMAIN: [&str; 6] = ["mechanism", "terrain", "soil", "gravity", "atmosphere", "camera"];
    let names = |line: &str| {
        let code = line.split("//").next().unwrap_or_default();
        let code = code.to_lowercase();
        DOMAIN.iter().any(|word| code.contains(word))
    };
    let found: Vec<String> = all_files()
        .into_iter()
        .filter(|(name, _)| name.starts_with("framework/runtime/src/"))
        .flat_map(|(name, path)| {
            let text = std::fs::read_to_string(path).unwrap();
            let lines = text.lines().enumerate().filter(|(_, line)| names(line));
            lines.map(|(k, line)| format!("{name}:{}: {line}", k + 1)).collect::<Vec<_>>()
        })
        .collect();
    assert!(names("    let m: MechanismPlan;") && !names("// the mechanism"), "the test sees code");
    none(found);
}

/// Imports in the runtime: each folder, and the folders above it in this list that it uses.
const RUNTIME: [(&str, &[&str]); 6] = [
    ("author", &[]),
    ("plan", &["author"]),
    ("compile", &["author", "plan"]),
    ("step", &["author", "plan"]),
    ("checkpoint", &["author", "plan", "step"]),
    ("recorders", &["author", "plan", "step", "checkpoint"]),
];

/// Imports in the assembly layer: each folder, and the folders above it in this list that it uses.
const ASSEMBLY: [(&str, &[&str]); 11] = [
    ("text", &[]),
    ("schema", &["text"]),
    ("scope", &["text", "schema"]),
    ("body", &["text", "schema"]),
    ("form", &["text", "schema", "scope", "body"]),
    ("machine", &["text", "schema", "body", "form"]),
    ("expand", &["text", "schema", "scope", "body", "form", "machine"]),
    ("mechanism", &["text", "schema", "body", "expand"]),
    ("wiring", &["text", "schema", "form", "expand", "mechanism"]),
    (
        "load",
        &["text", "schema", "scope", "body", "form", "machine", "expand", "mechanism", "wiring"],
    ),
    ("build", &["text", "schema", "body", "load"]),
];

/// Source files of a crate, by their path below its folder `src`.
fn sources_of(folder: &str) -> layers::Files {
    let files: layers::Files = (all_files().into_iter())
        .filter_map(|(name, path)| {
            let short = name.strip_prefix(folder).filter(|n| n.ends_with(".rs"))?.to_string();
            Some((short, std::fs::read_to_string(path).ok()?))
        })
        .collect();
    assert!(files.len() > 30, "only {} files found in {folder}", files.len());
    files
}

#[test]
fn the_assembly_floor_has_layers_without_circles() {
    let files = sources_of("framework/assembly/src/");
    none(layers::layers(&files, &ASSEMBLY));
    none(layers::circles(&files));
}

#[test]
fn the_runtime_has_layers_without_circles() {
    let files = sources_of("framework/runtime/src/");
    none(layers::layers(&files, &RUNTIME));
    none(layers::circles(&files));
}

#[test]
fn both_licences_are_here() {
    for (name, phrase) in [
        ("LICENSE-APACHE", "Version 2.0, January 2004"),
        ("LICENSE-MIT", "Permission is hereby granted, free of charge"),
    ] {
        let text = std::fs::read_to_string(root().join(name)).unwrap();
        assert!(text.contains(phrase), "{name}");
        assert!(text.contains("Linkwork contributors"), "{name} names no owner");
    }
}

#[test]
fn phrases_that_readers_have_to_translate_become_fewer() {
    let texts: Vec<(String, String)> = (all_files().into_iter())
        .filter(|(name, _)| name.ends_with(".rs") || name.ends_with(".md"))
        .filter(|(name, _)| !name.ends_with("CHANGELOG.md"))
        .filter_map(|(name, path)| Some((name, std::fs::read_to_string(path).ok()?)))
        .collect();
    assert!(texts.len() > 1000, "only {} files found", texts.len());
    for (kind, most) in PHRASES_MOST {
        let found: usize = texts.iter().map(|(name, text)| words::count(name, text, kind)).sum();
        assert!(
            found <= most,
            "{kind:?}: {found} phrases of `tests/src/tidy/words.rs`, {most} before: use the words of `framework/STYLE.md`"
        );
    }
}
