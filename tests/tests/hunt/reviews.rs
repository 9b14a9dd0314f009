//! `tests/hunt/reviews.md` lists every model of the catalogue in one line, and nothing else. Somebody who did not write a new model must review it
//! before its name is added there.
use linkwork_runtime::Catalogue;
use std::collections::BTreeMap;

/// Columns of the table: models, sources, faults, what changed, tests.
const COLUMNS: usize = 5;

/// Names in the first cell of a row: `library`: one, two; `library`: three.
fn names(cell: &str) -> Vec<String> {
    let group = |text: &str| -> Vec<String> {
        let (library, models) = text.split_once(':').unwrap_or_else(|| panic!("no colon: {text}"));
        let library = library.trim().trim_matches('`').to_string();
        models.split(',').map(|m| format!("{library}.{}", m.trim())).collect()
    };
    cell.split(';').flat_map(group).collect()
}

/// Returns how often each model is in the table.
fn reviewed(text: &str) -> BTreeMap<String, usize> {
    let mut found = BTreeMap::new();
    for line in text.lines().filter(|l| l.starts_with("| `")) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells.len(), COLUMNS, "columns of: {line}");
        assert!(cells.iter().all(|c| !c.is_empty()), "an empty cell: {line}");
        for name in names(cells[0]) {
            *found.entry(name).or_default() += 1;
        }
    }
    found
}

#[test]
fn every_model_of_the_catalogue_is_reviewed() {
    let file = linkwork_tests::root().join("tests/hunt/reviews.md");
    let found = reviewed(&std::fs::read_to_string(&file).unwrap());
    let libraries = linkwork_assemblies::libraries().into_iter();
    let catalogue = Catalogue::new(libraries.chain([linkwork_fmi::catalogue()]));
    let all: BTreeMap<&str, ()> =
        catalogue.iter().map(|entry| (entry.description.name.as_ref(), ())).collect();
    let missing: Vec<_> = all.keys().filter(|name| !found.contains_key(**name)).collect();
    let gone: Vec<_> = found.keys().filter(|name| !all.contains_key(name.as_str())).collect();
    let twice: Vec<_> = found.iter().filter(|(_, n)| **n > 1).collect();
    assert!(
        missing.is_empty() && gone.is_empty() && twice.is_empty(),
        "not reviewed: {missing:?}\nno models: {gone:?}\nin two lines: {twice:?}"
    );
}

/// Returns the number of rows of a table whose first cell names a public report by a number of its tracker.
fn with_reports(text: &str) -> usize {
    let named = |cell: &str| {
        let digit = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
        cell.split('#').skip(1).any(digit) || cell.split("PR ").skip(1).any(digit)
    };
    let cells = text.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
    cells.filter(|cell| named(cell)).count()
}

/// The numbers of reports in the README are those of the tables, and every area that was searched has at least fifteen.
#[test]
fn the_numbers_of_reports_are_those_of_the_tables() {
    let folder = linkwork_tests::root().join("tests/hunt");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let (mut all, mut tables) = (0, 0);
    for line in read("README.md").lines().filter(|line| line.starts_with("| [")) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let page = cells[0].split_once('(').and_then(|c| c.1.split_once(')')).unwrap().0;
        let stated: usize = cells[2].split([',', ' ']).next().unwrap().parse().unwrap();
        assert_eq!(stated, with_reports(&read(page)), "{page}");
        assert!(stated >= 15 || page == "combinations.md", "{page}: {stated} reports");
        (all, tables) = (all + stated, tables + 1);
    }
    assert!(tables == 13 && all >= 100, "{tables} tables, {all} reports");
    assert_eq!(with_reports("| a #12 | b #1 |\n|---|---|\n| c | d #3 |\n| e PR 7; f | - |"), 2);
}

/// Tests the check with a table that lacks a model, has one twice and has one that does not exist.
#[test]
fn names_of_a_row_are_read() {
    let row = "| `flight`: line, riser; `power`: heat_source | a | b | c | d |\n| `flight`: line | a | b | c | d |";
    let found = reviewed(row);
    let read: Vec<_> = found.iter().map(|(name, n)| (name.as_str(), *n)).collect();
    assert_eq!(read, [("flight.line", 2), ("flight.riser", 1), ("power.heat_source", 1)]);
}
