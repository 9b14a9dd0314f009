//! The examples of the book are correct: files are written, commands run, and their output is compared.
//!
//! | block | what happens |
//! |---|---|
//! | `ron,file=PATH`, `xml,file=PATH`, `python,file=PATH` | written to PATH |
//! | `sh` | run, line by line, and must succeed; `sh,fails`: must fail |
//! | `sh,elsewhere` | not run: needs a network, a window or a long build. Only commands of [`ELSEWHERE`] |
//! | `text,output` | each line is in the output of the last commands, its words in order |
//! | `rust`, `python` | run by `tests/book` and `sims/python/tests/test_readme.py` |
//! | `text` | formulas |
use crate::common::{Lab, root};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

/// Beginnings of commands that are not run here.
const ELSEWHERE: [&str; 6] =
    ["cargo ", "pip ", "rerun ", "export PATH=", "framework/book/build", "linkwork doctor"];

/// A fenced block.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    line: usize,
    kind: String,
    text: String,
}

/// Returns the blocks of a page, in order.
fn blocks(page: &str) -> Vec<Block> {
    let (mut found, mut open): (Vec<Block>, Option<Block>) = (Vec::new(), None);
    for (k, line) in page.lines().enumerate() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(kind)) => {
                open = Some(Block { line: k + 1, kind: kind.trim().into(), text: String::new() });
            }
            (Some(_), Some("")) => found.extend(open.take()),
            (Some(block), _) => {
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, None) => {}
        }
    }
    assert_eq!(open, None, "a block has no end");
    found
}

/// Returns the faults of a page, block by block.
fn faults(page: &str, lab: &Lab) -> Vec<String> {
    let (mut found, mut said) = (Vec::new(), None);
    for Block { line, kind, text } in blocks(page) {
        let mut fault = |what: String| found.push(format!("line {line}: {what}"));
        match kind.as_str() {
            "sh" | "sh,fails" => {
                let out = shell(lab, &text);
                if out.0 != (kind == "sh") {
                    fault(format!("`{kind}`, and it did not so:\n{text}{}", out.1));
                }
                said = Some(out.1);
            }
            "sh,elsewhere" => {
                let strange = text.lines().find(|l| !ELSEWHERE.iter().any(|e| l.starts_with(e)));
                if let Some(strange) = strange {
                    fault(format!("`{strange}` can be run here"));
                }
            }
            "text,output" => match &said {
                None => fault("no command before it".into()),
                Some(said) => {
                    for wanted in text.lines().filter(|l| !holds(said, l)) {
                        fault(format!("`{wanted}` is not in\n{said}"));
                    }
                }
            },
            "rust" | "python" | "text" => {}
            file => match file.split_once(",file=") {
                Some(("ron" | "xml" | "python", path)) => {
                    // The name of the file is not part of the block.
                    if !page.contains(&format!("`{path}`:\n```{file}\n")) {
                        fault(format!("the line above it is not `{path}`:"));
                    }
                    lab.write(path, &text);
                }
                _ => fault(format!("nobody knows what to do with a block `{file}`")),
            },
        }
    }
    found
}

/// Whether a line contains the words of another, whole and in order.
fn holds(said: &str, wanted: &str) -> bool {
    said.lines().any(|line| {
        let after = wanted.split_whitespace().try_fold(line, after);
        after.is_some()
    })
}

/// Returns the text after a whole word: `3` is not in `13`, `0.3` or `3.5`.
fn after<'a>(line: &'a str, word: &str) -> Option<&'a str> {
    let number = word.chars().all(|c| c.is_ascii_digit() || ".-+e".contains(c));
    let joins = |c: char| c.is_alphanumeric() || (number && c == '.');
    line.match_indices(word).find_map(|(at, _)| {
        let (before, rest) = (&line[..at], &line[at + word.len()..]);
        let alone = !before.ends_with(joins) && !rest.starts_with(joins);
        alone.then_some(rest)
    })
}

#[test]
fn a_number_is_not_a_part_of_another() {
    assert!(holds("`Friction.dampng` matches 3 of 13", "dampng 13"));
    assert!(holds("mass 3.5 kg, 1.2", "3.5 1.2"));
    for said in ["13", "0.3", "3.5", "a3"] {
        assert!(!holds(said, "3"), "{said}");
    }
}

/// Runs lines in a folder where `linkwork` is the program of this test. Returns success, and the whole output.
fn shell(lab: &Lab, script: &str) -> (bool, String) {
    let bin = Path::new(env!("CARGO_BIN_EXE_linkwork")).parent().unwrap();
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
    let mut c = Command::new("bash");
    c.args(["-euo", "pipefail", "-c", script]).current_dir(lab.path("")).env("PATH", path);
    let out = c.stdin(Stdio::null()).output().unwrap();
    let text = [out.stdout, out.stderr].map(|t| String::from_utf8_lossy(&t).into_owned());
    (out.status.success(), text.concat())
}

/// A folder with the simulations and assemblies of the repository, as at its top.
fn lab() -> Lab {
    let lab = Lab::new();
    for folder in ["sims", "assemblies"] {
        symlink(root().canonicalize().unwrap().join(folder), lab.path(folder)).unwrap();
    }
    lab
}

/// Returns the names and texts of the handwritten pages.
fn pages() -> Vec<(String, String)> {
    let folder = root().join("framework/book/src");
    let mut found: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
        .map(|p| {
            let name = p.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read_to_string(p).unwrap())
        })
        .collect();
    found.sort();
    found
}

#[test]
fn every_example_of_the_book_does_what_it_prints() {
    let pages = pages();
    assert!(pages.len() > 10, "{} pages", pages.len());
    let ran: Vec<String> = std::thread::scope(|s| {
        let jobs: Vec<_> = pages
            .iter()
            .map(|(name, text)| {
                s.spawn(move || {
                    let found = faults(text, &lab());
                    found.into_iter().map(|f| format!("{name}, {f}")).collect::<Vec<_>>()
                })
            })
            .collect();
        jobs.into_iter().flat_map(|j| j.join().unwrap()).collect()
    });
    assert!(ran.is_empty(), "\n{}", ran.join("\n"));
}

/// Models on the pages are in the catalogue, and links between chapters lead to existing pages.
#[test]
fn pages_name_models_and_pages_that_exist() {
    let catalogue = linkwork_cli::library().catalogue;
    let names: Vec<&str> = catalogue.iter().map(|e| &*e.description.name).collect();
    let libraries: Vec<&str> = names.iter().filter_map(|n| n.split('.').next()).collect();
    let pages = pages();
    let mut found = Vec::new();
    for (page, text) in &pages {
        for word in text.split('`').flat_map(|t| t.split('"')).map(|w| w.trim_end_matches(".*")) {
            let model = word.split_once('.').is_some_and(|(a, b)| {
                libraries.contains(&a) && b.chars().all(|c| c.is_alphanumeric() || c == '_')
            });
            if model && !names.contains(&word) {
                found.push(format!("{page}: there is no model `{word}`"));
            }
        }
        for link in text.split("](").skip(1).filter_map(|t| t.split(')').next()) {
            if link.ends_with(".md") && !pages.iter().any(|(name, _)| name == link) {
                found.push(format!("{page}: there is no page `{link}`"));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
    // Every page is in the list of chapters.
    let list = &pages.iter().find(|(name, _)| name == "SUMMARY.md").unwrap().1;
    for (page, _) in pages.iter().filter(|(name, _)| name != "SUMMARY.md") {
        assert!(list.contains(&format!("({page})")), "`{page}` is not in SUMMARY.md");
    }
}

/// The small simulations on the pages of models run without a warning, each with its model and a plot.
#[test]
fn behaviours_of_models_run() {
    let folder = root().join("assemblies/behaviours").canonicalize().unwrap();
    let lab = lab();
    let files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(files.len() > 10, "{} behaviours", files.len());
    for file in files {
        let (path, name) = (file.display().to_string(), file.file_stem().unwrap());
        let name = name.to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.contains(&format!("model: \"{name}\"")), "{name} is not in its simulation");
        let checked = lab.linkwork(&["check", &path]).code(0);
        assert!(!format!("{}{}", checked.out, checked.err).contains("warning"), "{checked:?}");
        lab.run(&path, &name, &["--no-log"]).code(0);
        assert!(lab.path(&name).join("plots.svg").exists(), "{name} has no plots");
    }
}

#[test]
fn each_mistake_of_a_page_is_found() {
    let page = "```sh\ntrue\n```\n```text,output\nnever said\n```\n```sh\nfalse\n```\n```sh,fails\ntrue\n```\n\
                ```sh,elsewhere\nlinkwork run x\n```\n```mermaid\nx\n```\n```sh\nlinkwork run sims/none\n```\n```ron,file=c.ron\nx\n```\n";
    let found = faults(page, &lab());
    let wanted = [
        "line 4: `never said`",
        "line 7: `sh`",
        "line 10: `sh,fails`",
        "line 13: `linkwork run x` can",
        "line 16: nobody",
        "line 19: `sh`",
        "line 22: the line above",
    ];
    assert_eq!(found.len(), wanted.len(), "{found:#?}");
    for (found, wanted) in found.iter().zip(wanted) {
        assert!(found.starts_with(wanted), "{found}");
    }
    let page = "```sh\necho one   two three\n```\n```text,output\none three\n```\n`a/b.ron`:\n```ron,file=a/b.ron\nx\n```\n```sh\ngrep x a/b.ron\n```\n";
    assert_eq!(faults(page, &lab()), [""; 0]);
}
