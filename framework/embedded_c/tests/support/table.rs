//! The table of C functions as cbindgen can read it: `calls!` of `src/call.rs`, expanded in the text of a source file.

/// Returns the source with each declaration of a table as a function without a body. The source is formatted by rustfmt.
pub fn expand(source: &str) -> String {
    let (mut made, mut declaration) = (String::new(), String::new());
    let (mut table, mut body) = (false, false);
    for line in source.lines() {
        match (table, line) {
            (false, "calls![") => table = true,
            (false, _) => made += &format!("{line}\n"),
            (true, "];") => table = false,
            (true, _) if body => body = line != "    }",
            (true, _) if line.trim_start().starts_with("///") => {
                made += &format!("{}\n", line.trim())
            }
            (true, _) => {
                declaration += line.trim();
                body = declaration.ends_with('{');
                if body || declaration.ends_with(';') {
                    made += &function(&declaration);
                    declaration.clear();
                }
            }
        }
    }
    assert!(!table && declaration.is_empty(), "unfinished table:\n{declaration}");
    made
}

/// Returns one declaration, `fn name(arguments) {` or `fn name(arguments);`, as a C function.
fn function(declaration: &str) -> String {
    let (name, arguments) = declaration.split_once('(').unwrap();
    let (arguments, end) = arguments.rsplit_once(')').unwrap();
    let arguments: Vec<String> =
        arguments.split(',').filter(|a| !a.is_empty()).map(argument).collect();
    let result = if end == ";" { "" } else { " -> LwStatus" };
    format!(
        "#[unsafe(no_mangle)]\npub unsafe extern \"C\" {name}({}){result} {{}}\n",
        arguments.join(", ")
    )
}

/// Returns an argument with its type in C: the kinds in the documentation of `src/call.rs`.
fn argument(argument: &str) -> String {
    let (name, kind) = argument.trim().split_once(": ").unwrap();
    let handle = |handle| match handle {
        "LwBuilder" => "builder",
        "LwModel" => "model",
        "LwRobot" => "robot",
        "LwPriorities" => "problem",
        _ => panic!("unknown handle {handle}"),
    };
    let out = kind.strip_prefix("Option<").and_then(|k| k.strip_suffix('>')).unwrap_or(kind);
    let out = out.strip_prefix("Out<").and_then(|k| k.strip_suffix('>'));
    match kind {
        "&str" => format!("{name}: *const c_char"),
        "Part" | "Object" | "ColliderId" => format!("{name}: u32"),
        _ => match (out, kind.strip_prefix("&mut "), kind.strip_prefix('&')) {
            (Some(value), ..) => format!("{name}: *mut {value}"),
            (_, Some(of), _) => format!("{}: *mut {of}", handle(of)),
            (.., Some(of)) => format!("{}: *const {of}", handle(of)),
            _ => argument.trim().to_owned(),
        },
    }
}
