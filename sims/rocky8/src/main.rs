//! `rocky8 FOLDER`: reads `rocky8_mbody.json` and `rocky8_assembly.json` there and writes the files of
//! `sims/rocky8` that follow from them.
use std::path::Path;
use std::process::ExitCode;

fn run() -> Result<(), String> {
    let Some(folder) = std::env::args().nth(1) else {
        return Err("usage: rocky8 FOLDER (with rocky8_mbody.json and rocky8_assembly.json)".into());
    };
    let read = |name: &str| {
        let path = Path::new(&folder).join(name);
        std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let files =
        linkwork_rocky8::convert(&read("rocky8_mbody.json")?, &read("rocky8_assembly.json")?)?;
    for (name, text) in files {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}
