//! PDS3 images: a label of `KEY = VALUE` lines, detached (.lbl) or at the head of the image (.img).
//! ```text
//! ^IMAGE = 9            record of RECORD_BYTES, from 1      = 512 <BYTES>   byte, from 1
//!        = "A.IMG"      another file                        = ("A.IMG", 9)  a record of it
//! h = sample · SCALING_FACTOR + OFFSET, in UNIT
//! MAP_SCALE = 1.0 <M/PIXEL>,  x of column c, line l: (c − SAMPLE_PROJECTION_OFFSET) s,  y = (LINE_PROJECTION_OFFSET − l) s
//! ```

use super::projection::Projection;
use super::samples::{self, Array, First, Missing, Order, Sample};
use super::{Heights, HeightsError, HeightsOptions, length, text, units};

/// An entry of a label.
struct Entry {
    line: usize,
    /// Enclosing objects, outermost first, as in `UNCOMPRESSED_FILE/IMAGE`.
    within: String,
    key: String,
    value: String,
}

struct Label(Vec<Entry>);

/// Reads the entries up to END. A value continues over lines until its brackets and quotes are closed.
fn read(head: &str) -> Result<Label, HeightsError> {
    let mut entries = Vec::new();
    let mut within: Vec<String> = Vec::new();
    let mut lines = head.lines().enumerate();
    while let Some((at, line)) = lines.next() {
        let line = line.split("/*").next().unwrap_or_default().trim();
        if line == "END" {
            return Ok(Label(entries));
        }
        let place = format!("line {}", at + 1);
        let Some((key, value)) = line.split_once('=') else {
            if line.starts_with("END_OBJECT") || line.starts_with("END_GROUP") {
                within.pop();
            }
            continue;
        };
        let (key, mut value) = (key.trim().to_uppercase(), value.trim().to_string());
        while is_open(&value) {
            let Some((_, more)) = lines.next() else {
                let fact = format!("the value of `{key}` does not end");
                return Err(HeightsError::at(place, fact, "use the complete label"));
            };
            value = format!("{value} {}", more.trim()).trim().to_string();
            if value.len() > 1 << 16 {
                let fact = format!("the value of `{key}` is longer than 64 KiB");
                return Err(HeightsError::at(place, fact, "close its quotes and brackets"));
            }
        }
        match key.as_str() {
            "OBJECT" | "GROUP" => within.push(value),
            "END_OBJECT" | "END_GROUP" => drop(within.pop()),
            _ => entries.push(Entry { line: at + 1, within: within.join("/"), key, value }),
        }
    }
    Err(HeightsError::content("the label lacks END", "use the complete label"))
}

/// Whether a value continues in the next line because quotes, or brackets outside of quotes, are not closed.
fn is_open(value: &str) -> bool {
    let (mut quoted, mut depth) = (false, 0);
    for c in value.chars() {
        match c {
            '"' => quoted = !quoted,
            '(' | '{' if !quoted => depth += 1,
            ')' | '}' if !quoted => depth -= 1,
            _ => {}
        }
    }
    quoted || depth > 0 || value.is_empty()
}

impl Label {
    /// Returns the entry of an object at any depth.
    fn of(&self, object: &str, key: &str) -> Option<&Entry> {
        let fits = |e: &&Entry| e.key == key && e.within.rsplit('/').next() == Some(object);
        self.0.iter().find(fits)
    }

    /// Returns the entry of any object.
    fn any(&self, key: &str) -> Option<&Entry> {
        self.0.iter().find(|e| e.key == key)
    }

    fn wanted(&self, key: &str) -> Result<&Entry, HeightsError> {
        let fact = format!("the label lacks {key} of the object IMAGE");
        self.of("IMAGE", key).ok_or_else(|| HeightsError::content(fact, "heights must be an IMAGE"))
    }
}

impl Entry {
    fn place(&self) -> String {
        format!("line {}", self.line)
    }
    /// Reads number and unit: `1.0 <M/PIXEL>`.
    fn number(&self) -> Result<(f64, &str), HeightsError> {
        let (number, unit) = self.value.split_once('<').unwrap_or((&self.value, ""));
        let value = number.trim().trim_matches('"').parse::<f64>();
        match value {
            Ok(v) if v.is_finite() => Ok((v, unit.trim().trim_end_matches('>'))),
            _ => {
                let fact = format!("`{}` is not a valid number for {}", self.value, self.key);
                Err(HeightsError::at(self.place(), fact, "write a number"))
            }
        }
    }
    fn count(&self) -> Result<u64, HeightsError> {
        let (v, _) = self.number()?;
        match (0.0..=1e15).contains(&v) && v.fract() == 0.0 {
            true => Ok(v as u64),
            false => {
                let fact = format!("{v} is not a valid number for {}", self.key);
                Err(HeightsError::at(self.place(), fact, "write an integer"))
            }
        }
    }
    fn word(&self) -> String {
        self.value.trim().trim_matches('"').trim().to_uppercase()
    }
}

/// Returns the start of the image: its file, unless it is this one, and the offset there.
fn pointer(label: &Label) -> Result<(Option<String>, u64), HeightsError> {
    let Some(entry) = label.any("^IMAGE") else {
        return Err(HeightsError::content(
            "the label lacks ^IMAGE",
            "heights must be an IMAGE: use the label of the image",
        ));
    };
    let inner = entry.value.trim().trim_start_matches('(').trim_end_matches(')');
    let mut parts: Vec<&str> = inner.split(',').map(str::trim).collect();
    let quoted = parts.first().is_some_and(|p| p.starts_with('"'));
    let file = quoted.then(|| parts.remove(0).trim_matches('"').trim().to_string());
    let fault = |fact: String| {
        HeightsError::at(entry.place(), fact, "write a record, or a byte: `^IMAGE = 513 <BYTES>`")
    };
    let start = match parts.as_slice() {
        [] => 1,
        [at] => {
            let digits: String = at.chars().take_while(char::is_ascii_digit).collect();
            digits
                .parse::<u64>()
                .map_err(|_| fault(format!("`{at}` is not a position of the image")))?
        }
        _ => return Err(fault(format!("`{}` is not the position of one image", entry.value))),
    };
    let start = start.checked_sub(1).ok_or_else(|| fault("positions begin at 1".into()))?;
    if inner.to_uppercase().contains("<BYTES>") {
        return Ok((file, start));
    }
    let record = match label.any("RECORD_BYTES") {
        Some(record) => record.count()?,
        None if start == 0 => 0,
        None => return Err(fault("the label lacks RECORD_BYTES".into())),
    };
    Ok((file, start.saturating_mul(record)))
}

/// Type of samples.
fn kind(label: &Label) -> Result<(Sample, Order), HeightsError> {
    let (entry, bits) = (label.wanted("SAMPLE_TYPE")?, label.wanted("SAMPLE_BITS")?.count()?);
    let order = |word: &str| match word.contains("LSB") || word.contains("PC_") {
        true => Order::Little,
        false => Order::Big,
    };
    let word = entry.word();
    let sample = match (word.as_str(), bits) {
        ("VAX_REAL" | "VAX_DOUBLE", _) => None,
        (w, 32 | 64) if w.ends_with("REAL") || w.ends_with("FLOAT") => {
            Some(Sample::Real(bits as usize / 8))
        }
        (w, 8 | 16 | 32) if w.ends_with("UNSIGNED_INTEGER") => {
            Some(Sample::Unsigned(bits as usize / 8))
        }
        (w, 8 | 16 | 32) if w.ends_with("INTEGER") => Some(Sample::Signed(bits as usize / 8)),
        _ => None,
    };
    // Integers of DEC computers have the byte order of a PC.
    let little = word.contains("VAX");
    sample.map(|s| (s, if little { Order::Little } else { order(&word) })).ok_or_else(|| {
        HeightsError::at(
            entry.place(),
            format!("samples of {bits} bits of the type {word} are not supported"),
            "use integers of 8, 16 or 32 bits, or IEEE_REAL or PC_REAL of 32 or 64 bits",
        )
    })
}

fn array(label: &Label, start: u64) -> Result<Array, HeightsError> {
    let (sample, order) = kind(label)?;
    let count = |key: &str, otherwise: u64| {
        label.of("IMAGE", key).map(Entry::count).transpose().map(|n| n.unwrap_or(otherwise))
    };
    let number = |key: &str, otherwise: f64| {
        let entry = label.of("IMAGE", key);
        entry.map(|e| e.number().map(|n| n.0)).transpose().map(|n| n.unwrap_or(otherwise))
    };
    let bands = count("BANDS", 1)?;
    if bands != 1 {
        return Err(HeightsError::Pixels { what: format!("{bands} bands") });
    }
    if let Some(entry) = label.of("IMAGE", "ENCODING_TYPE")
        && !["N/A", "NONE"].contains(&entry.word().as_str())
    {
        let fact = format!("the encoding {} is not supported", entry.word());
        return Err(HeightsError::at(entry.place(), fact, "decode the image first"));
    }
    let metre = match label.of("IMAGE", "UNIT") {
        Some(entry) => units::metres(&entry.place(), &entry.word())?,
        None => 1.0,
    };
    let mut missing = Vec::new();
    for key in ["MISSING_CONSTANT", "MISSING", "NULL", "CORE_NULL", "INVALID_CONSTANT"] {
        let Some(entry) = label.of("IMAGE", key) else { continue };
        let parsed = Missing::parse(&entry.value).ok_or_else(|| {
            let fact = format!("`{}` is not a sample", entry.value);
            HeightsError::at(entry.place(), fact, "write a number, or its bits as 16#FF7FFFFB#")
        })?;
        missing.push(parsed);
    }
    let south = label.of("IMAGE", "LINE_DISPLAY_DIRECTION").is_some_and(|e| e.word() == "UP");
    Ok(Array {
        sample,
        order,
        start,
        lines: label.wanted("LINES")?.count()?,
        columns: label.wanted("LINE_SAMPLES")?.count()?,
        around: [count("LINE_PREFIX_BYTES", 0)?, count("LINE_SUFFIX_BYTES", 0)?],
        first: if south { First::South } else { First::North },
        missing,
        scale: metre * number("SCALING_FACTOR", 1.0)?,
        offset: metre * number("OFFSET", 0.0)?,
    })
}

/// Returns the spacing (m), and the south-west node if the label contains the origin of the map.
fn frame(label: &Label, lines: u64) -> Result<([f64; 2], [f64; 2]), HeightsError> {
    let Some(scale) = label.any("MAP_SCALE") else {
        if let Some(resolution) = label.any("MAP_RESOLUTION") {
            let (per_degree, _) = resolution.number()?;
            let degrees = 1.0 / per_degree;
            return Err(HeightsError::Degrees { x: degrees, y: degrees });
        }
        return Err(HeightsError::NoScale { what: "the label" });
    };
    let (value, unit) = scale.number()?;
    if unit.to_uppercase().starts_with("DEG") {
        return Err(HeightsError::Degrees { x: value, y: value });
    }
    let s = length(&scale.place(), value * units::metres(&scale.place(), unit)?)?;
    let offsets = (label.any("SAMPLE_PROJECTION_OFFSET"), label.any("LINE_PROJECTION_OFFSET"));
    let origin = match offsets {
        (Some(x), Some(y)) => {
            let (x, y) = (x.number()?.0, y.number()?.0);
            [-x * s, (y - (lines as f64 - 1.0)) * s]
        }
        _ => return Ok(([s, s], [0.0, 0.0])),
    };
    match cylindrical(label)? {
        Some(projection) => projection.apart([s, s], origin, 0.0, lines as usize),
        None => Ok(([s, s], origin)),
    }
}

/// Returns the projection of a label if it is equidistant cylindrical; y is zero at the equator.
fn cylindrical(label: &Label) -> Result<Option<Projection>, HeightsError> {
    let kind = label.any("MAP_PROJECTION_TYPE").map(|e| e.word().replace('_', " ").to_uppercase());
    let simple = match kind.as_deref() {
        Some("SIMPLE CYLINDRICAL") => true,
        Some("EQUIRECTANGULAR" | "EQUIDISTANT CYLINDRICAL") => false,
        _ => return Ok(None),
    };
    let Some(radius) = label.any("A_AXIS_RADIUS") else { return Ok(None) };
    let (value, unit) = radius.number()?;
    // Labels give radii in kilometres.
    let unit = if unit.is_empty() { 1e3 } else { units::metres(&radius.place(), unit)? };
    let parallel = match label.any("CENTER_LATITUDE").filter(|_| !simple) {
        Some(entry) => entry.number()?.0.to_radians(),
        None => 0.0,
    };
    let radius = length(&radius.place(), value * unit)?;
    Ok(Some(Projection::Cylindrical { radius, parallel, origin: 0.0 }))
}

fn assemble(
    label: &Label,
    start: u64,
    data: &[u8],
    options: &HeightsOptions,
) -> Result<Heights, HeightsError> {
    let array = array(label, start)?;
    let (spacing, origin) = match options.spacing {
        Some(spacing) => (spacing, [0.0, 0.0]),
        None => frame(label, array.lines)?,
    };
    let (heights, datum) = samples::heights(data, &array)?;
    let (nx, ny) = (array.columns as usize, array.lines as usize);
    Ok(Heights { nx, ny, heights, datum, spacing, origin })
}

/// Reads the image of a detached label, which names its data file.
pub(super) fn labelled(
    bytes: &[u8],
    options: &HeightsOptions,
    beside: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Heights, HeightsError> {
    let label = read(&text(bytes))?;
    let (file, start) = pointer(&label)?;
    let Some(file) = file else { return assemble(&label, start, bytes, options) };
    // Labels contain file names in capitals, but the files may have lower case.
    let data = beside(&file).or_else(|why| beside(&file.to_lowercase()).map_err(|_| why));
    let data = data.map_err(|why| HeightsError::Companion { name: file, why })?;
    assemble(&label, start, &data, options)
}

/// Size of the part at the start of an image that may contain a label, in bytes.
const HEAD: usize = 1 << 20;

/// Reads an image with its label at its start, or in a file with the same name.
pub(super) fn image(
    stem: &str,
    bytes: &[u8],
    options: &HeightsOptions,
    beside: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Heights, HeightsError> {
    let head = &bytes[..bytes.len().min(HEAD)];
    let attached =
        [b"PDS_VERSION_ID".as_slice(), b"ODL_VERSION_ID", b"CCSD3Z", b"NJPL1I", b"LBLSIZE"];
    if !attached.iter().any(|a| head.starts_with(a)) {
        let found = beside(&format!("{stem}.lbl")).or_else(|_| beside(&format!("{stem}.LBL")));
        let label = found.map_err(|_| {
            HeightsError::content(
                "the image does not begin with a PDS3 label, and there is no label file next to it",
                format!("put `{stem}.lbl` in its folder, or use the name of the label"),
            )
        })?;
        let label = read(&text(&label))?;
        let (_, start) = pointer(&label)?;
        return assemble(&label, start, bytes, options);
    }
    let label = read(&text(head))?;
    match pointer(&label)? {
        (None, start) => assemble(&label, start, bytes, options),
        (Some(file), start) => {
            let data = beside(&file).map_err(|why| HeightsError::Companion { name: file, why })?;
            assemble(&label, start, &data, options)
        }
    }
}
