//! Writes the sources of the book: `linkwork-book FOLDER`. Plots of behaviours that are in FOLDER/models are shown.
use linkwork_book::headers::headers;
use linkwork_book::models::{Behaviour, page};
use linkwork_book::summary::{libraries, library_page, summary};
use linkwork_book::{SOURCES, catalogue, root};
use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("usage: linkwork-book FOLDER")?;
    let (folder, root) = (Path::new(&folder), root());
    let pages = folder.join("models");
    fs::create_dir_all(&pages)?;
    let hand = root.join("framework/book/src");
    for entry in fs::read_dir(&hand)? {
        let path = entry?.path();
        if path.is_file() {
            fs::copy(&path, folder.join(path.file_name().ok_or("a file without a name")?))?;
        }
    }
    let (catalogue, headers) = (catalogue(), headers(&root, &SOURCES)?);
    for entry in catalogue.iter() {
        let name = &*entry.description.name;
        let ron = root.join(format!("assemblies/behaviours/{name}.ron"));
        let behaviour = match fs::read_to_string(&ron) {
            Ok(ron) => {
                let plots = format!("{name}.svg");
                if !pages.join(&plots).is_file() {
                    let fact = format!("there are no plots `{}`", pages.join(&plots).display());
                    return Err(format!("{fact}\n  help: run framework/book/build").into());
                }
                Some(Behaviour { ron, plots })
            }
            Err(_) => None,
        };
        let text = page(entry, headers.get(name), behaviour.as_ref());
        fs::write(pages.join(format!("{name}.md")), text)?;
    }
    for (library, names) in libraries(&catalogue) {
        let text = library_page(&library, &names, &catalogue);
        fs::write(pages.join(format!("{library}.md")), text)?;
    }
    let text = fs::read_to_string(hand.join("SUMMARY.md"))?;
    fs::write(folder.join("SUMMARY.md"), summary(&text, &catalogue)?)?;
    Ok(())
}
