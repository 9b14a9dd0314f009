//! The calls of robot.hpp: each returns the result of its function in robot.h, and none is missing.

use crate::support::*;
use linkwork_robot::*;
use std::path::PathBuf;
use std::process::Command;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn calls_of_cpp_say_what_those_of_c_say() {
    if Command::new("c++").arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none(), "`c++` is missing");
        println!("skipped: no `c++` is here");
        return;
    }
    let test = std::env::current_exe().unwrap();
    let library = test.parent().unwrap().join("liblinkwork_robot.a");
    let scratch = tempfile::tempdir().unwrap();
    let (program, file) = (scratch.path().join("calls"), scratch.path().join("two.urdf"));
    std::fs::write(&file, urdf()).unwrap();
    let compiler = |standard: &str| {
        let mut call = Command::new("c++");
        call.args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]);
        call.arg(folder().join("include")).arg(folder().join("tests/calls.cpp"));
        call
    };
    // The header must also compile with the spans of the standard library.
    let later = compiler("-std=c++20").arg("-fsyntax-only").output().unwrap();
    assert!(later.status.success(), "{}", String::from_utf8_lossy(&later.stderr));
    let built = compiler("-std=c++17")
        .arg(library)
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program)
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let ran = Command::new(&program).arg(&file).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    // The program must call the intended overloads.
    let two = Two::new();
    let mut wanted = Vec::new();
    // SAFETY: valid handles of the library, arrays of the lengths given.
    unsafe {
        let mut all = vec![std::mem::zeroed::<LwClosest>(); 40];
        for detail in [LW_DETAIL_FINE, LW_DETAIL_COARSE] {
            assert_eq!(lw_robot_set_detail(two.r, detail), LwStatus::Ok);
            let (out, mut count) = (all.as_mut_ptr(), 0);
            let told = lw_robot_distances(two.r, Q.as_ptr(), 13, 0.6, out, 40, &mut count);
            assert_eq!(told, LwStatus::Ok);
            wanted.extend(all[..count].iter().map(|c| (c.a, c.b, c.distance.to_bits())));
        }
    }
    let said = String::from_utf8(ran.stdout).unwrap();
    let said = said.lines().map(|line| {
        let [a, b, d] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
        (a.parse().unwrap(), b.parse().unwrap(), d.parse::<f64>().unwrap().to_bits())
    });
    assert_eq!(said.collect::<Vec<(u32, u32, u64)>>(), wanted);
    assert!(wanted.len() > 4, "{wanted:?}");
}

/// Returns the names of the functions in a text.
fn names(text: &str) -> Vec<&str> {
    let mut all: Vec<&str> = text
        .match_indices("lw_")
        .filter(|(at, _)| !text[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        .map(|(at, _)| {
            let rest = &text[at..];
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            &rest[..end.unwrap_or(rest.len())]
        })
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[test]
fn every_function_has_a_wrapper_and_tests() {
    let read = |path: PathBuf| std::fs::read_to_string(path).unwrap();
    let header = read(folder().join("include/linkwork/robot.h"));
    // Count declarations only, and not names in comments.
    let code: Vec<&str> = header.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
    let code = code.join("\n");
    let functions = names(&code);
    assert!(functions.len() > 100, "{}", functions.len());
    // Everything that the README names must exist.
    let page = read(folder().join("README.md"));
    let named = names(&page);
    assert!(named.len() > 60, "{}", named.len());
    named.iter().for_each(|f| assert!(functions.contains(f), "README.md names {f}"));
    let wrapper = read(folder().join("include/linkwork/robot.hpp"));
    let wrapped = names(&wrapper);
    let mut tests = String::new();
    for file in std::fs::read_dir(folder().join("tests")).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|e| e == "rs") {
            tests += &read(path);
        }
    }
    let tested = names(&tests);
    for f in functions {
        // The version is a constant text, which does not need a wrapper.
        assert!(f == "lw_version" || wrapped.contains(&f), "{f} has no wrapper in robot.hpp");
        // The texts of codes are tested elsewhere.
        assert!(tested.contains(&f) || f == "lw_status_text", "{f} has no test");
    }
}
