//! `linkwork terrain`: shows, converts, resamples and creates height maps.
use linkwork_assembly::{Failure, read_value};
use linkwork_environment::generated_terrain::GeneratedParams;
use linkwork_environment::map_file::{OpenMap, Resampled, Survey, hillshade, open_map, write_map};
use linkwork_environment::map_parts::{Cropped, Mosaic};
use linkwork_environment::terrain::GridTerrain;
use linkwork_environment::tiles::{HeightRows, TILE};
use linkwork_formats::heights::{HeightsOptions, write_shades};
use linkwork_program::clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use linkwork_program::voice::report;
use linkwork_program::{Tool, exit, say};
use linkwork_runtime::{
    BuildError, Fault, Files, Located, Origin, Params as _, ReadCx, Service as _, Services, Value,
};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// The command.
pub const TERRAIN: Tool = Tool { command, run };

fn command() -> Command {
    let file = |name: &'static str, help: &'static str| {
        Arg::new(name)
            .value_name("FILE")
            .required(true)
            .value_parser(value_parser!(PathBuf))
            .help(help)
    };
    let pair = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).allow_hyphen_values(true).help(help)
    };
    let from =
        || file("from", "Map to read: .tif, .asc, .xyz, .png, .bmp, .lbl, .img, .xml, .tiles");
    let to = || file("to", "Map to write: .tif, .asc, .png, .tiles");
    let spacing = || {
        let help = "Distance between nodes in m, X or X,Y, instead of the value in the file; required for images and maps in degrees";
        pair("spacing", "X,Y", help)
    };
    let range = || pair("range", "LOW,HIGH", "Heights of black and white in an image, in m");
    let tile = || {
        Arg::new("tile")
            .long("tile")
            .value_name("CELLS")
            .value_parser(value_parser!(usize))
            .help("Cells along an edge of a tile in .tiles, 16 to 1024 (default: 256)")
    };
    let set = Arg::new("set").long("set").value_name("NAME=VALUE").action(ArgAction::Append);
    Command::new("terrain")
        .about("Show, convert, resample and create height maps")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(
            Command::new("show")
                .about("Print the size, heights, a histogram and a picture of a map")
                .args([from(), spacing(), range()])
                .arg(
                    Arg::new("picture")
                        .long("picture")
                        .value_name("FILE")
                        .value_parser(value_parser!(PathBuf))
                        .help("Also write the picture as a PNG file"),
                ),
        )
        .subcommand(
            Command::new("convert")
                .about("Convert a map to another format, row by row: a GeoTIFF or tiles may be larger than memory")
                .args([from(), to(), spacing(), range(), tile()]),
        )
        .subcommand(
            Command::new("resample")
                .about("Interpolate a map at other nodes; if they are farther apart, each is the mean of its surroundings")
                .args([from(), to(), spacing(), range(), tile()])
                .arg(pair("to-spacing", "X,Y", "Distance between the new nodes in m, X or X,Y").required(true)),
        )
        .subcommand(
            Command::new("crop")
                .about("Cut out a part of a map, row by row")
                .args([from(), to(), spacing(), range(), tile()])
                .arg(pair("within", "X0,Y0,X1,Y1", "West, south, east and north limits in m, in the coordinates that `show` prints").required(true)),
        )
        .subcommand(
            Command::new("merge")
                .about("Combine maps with common nodes into one; where several have data, the last one is used")
                .args([
                    Arg::new("maps")
                        .value_name("MAPS")
                        .required(true)
                        .num_args(2..)
                        .value_parser(value_parser!(PathBuf))
                        .help("Maps to read, two or more"),
                    to().long("out"),
                    tile(),
                ]),
        )
        .subcommand(
            Command::new("make")
                .about("Write generated ground of environment.generated_terrain to a file")
                .args([to(), tile()])
                .arg(
                    Arg::new("params")
                        .value_name("PARAMS")
                        .value_parser(value_parser!(PathBuf))
                        .help("File with parameters: { \"seed\": 3, \"size\": [50, 50] }"),
                )
                .arg(set.help(
                    "Set a parameter (repeatable): seed=3, size=[50,50], spacing=\"5 cm\", \
                     landforms=[{ \"kind\": \"step\", \"at\": [5, 0], \"length\": 2, \"width\": 2, \"height\": 0.2 }]",
                )),
        )
}

fn fault(message: String, help: Option<String>) -> Failure {
    let faults = vec![Fault { message, origin: Origin::NONE, help }];
    Failure { faults, sources: Default::default() }
}

/// Converts an error, with the name of its parameter.
fn told(e: BuildError) -> Failure {
    let place = e.param.map_or(String::new(), |p| format!("`{p}`: "));
    fault(format!("{place}{}", e.message), e.help)
}

/// Reads an option with the value `X` or `X,Y`.
fn pair(options: &ArgMatches, name: &str) -> Result<Option<[f64; 2]>, Failure> {
    let Ok(Some(text)) = options.try_get_one::<String>(name) else { return Ok(None) };
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|w| w.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([x]) if x.is_finite() && name != "range" => Ok(Some([*x, *x])),
        Ok([x, y]) if x.is_finite() && y.is_finite() => Ok(Some([*x, *y])),
        _ => {
            let help = format!(
                "write --{name} {}",
                if name == "range" { "-10,25" } else { "0.5 or 0.5,0.25" }
            );
            Err(fault(format!("`--{name} {text}` is not a pair of numbers"), Some(help)))
        }
    }
}

fn path<'a>(options: &'a ArgMatches, name: &str) -> &'a Path {
    options.get_one::<PathBuf>(name).map_or(Path::new(""), PathBuf::as_path)
}

fn tile(options: &ArgMatches) -> usize {
    options.get_one::<usize>("tile").copied().unwrap_or(TILE)
}

fn open(options: &ArgMatches) -> Result<OpenMap, Failure> {
    let read = HeightsOptions {
        spacing: pair(options, "spacing")?,
        range: pair(options, "range")?.unwrap_or([0.0, 1.0]),
    };
    // Help texts name the parameter of a service; here it is an option.
    open_map(path(options, "from"), &read).map_err(|e| {
        let help = e.help.map(|h| {
            h.replace("write `spacing: (0.1, 0.1)`", "write `--spacing 0.1`")
                .replace("`spacing: (30, 30)`", "`--spacing 30`")
        });
        fault(e.message, help)
    })
}

fn write(options: &ArgMatches, rows: &mut dyn HeightRows) -> Result<(), Failure> {
    let (to, grid) = (path(options, "to"), rows.grid());
    let range = write_map(to, rows, tile(options)).map_err(told)?;
    let ([nx, ny], [sx, sy]) = (grid.size(), grid.spacing());
    let bytes = to.metadata().map_or(0, |m| m.len());
    say!(
        "{}: {nx} x {ny} nodes, {sx} m x {sy} m apart, {:.1} MB",
        to.display(),
        bytes as f64 / 1e6
    );
    if let Some([low, high]) = range {
        say!("black is {low} m, white is {high} m: --spacing {sx},{sy} --range {low},{high}");
    }
    Ok(())
}

fn run(options: &ArgMatches) -> u8 {
    let done = match options.subcommand() {
        Some(("show", options)) => show(options),
        Some(("convert", options)) => open(options).and_then(|mut map| write(options, &mut map)),
        Some(("resample", options)) => resample(options),
        Some(("crop", options)) => crop(options),
        Some(("merge", options)) => merge(options),
        Some(("make", options)) => make(options),
        _ => Ok(()),
    };
    match done {
        Ok(()) => exit::OK,
        Err(failure) => report(&failure),
    }
}

fn resample(options: &ArgMatches) -> Result<(), Failure> {
    let spacing = pair(options, "to-spacing")?.unwrap_or([1.0; 2]);
    let mut rows = Resampled::new(open(options)?, spacing).map_err(told)?;
    write(options, &mut rows)
}

fn crop(options: &ArgMatches) -> Result<(), Failure> {
    let text = options.get_one::<String>("within").map_or("", String::as_str);
    let limits: Result<Vec<f64>, _> = text.split(',').map(|w| w.trim().parse::<f64>()).collect();
    let Ok(&[x0, y0, x1, y1]) = limits.as_deref() else {
        let help = "write the west, south, east and north limits: --within 0,0,100,50";
        return Err(fault(format!("`--within {text}` is not four numbers"), Some(help.into())));
    };
    let mut rows = Cropped::new(open(options)?, [x0, y0, x1, y1]).map_err(told)?;
    write(options, &mut rows)
}

fn merge(options: &ArgMatches) -> Result<(), Failure> {
    let paths = options.get_many::<PathBuf>("maps").into_iter().flatten();
    let maps: Result<Vec<_>, _> = paths
        .map(|path| Ok((path.display().to_string(), open_map(path, &HeightsOptions::default())?)))
        .collect();
    let mut rows = maps.and_then(Mosaic::new).map_err(told)?;
    write(options, &mut rows)
}

/// Reads a value in RON, or returns the text itself if it is a word: `5 cm`.
fn value(name: &str, text: &str) -> Result<Located, Failure> {
    let written = text.trim_start().starts_with(['[', '(', '{', '"']);
    match read_value(name, text) {
        Ok((value, _)) => Ok(value),
        Err(failure) if written => Err(failure),
        Err(_) => Ok(Located::from(Value::Text(text.trim().to_string()))),
    }
}

fn make(options: &ArgMatches) -> Result<(), Failure> {
    let mut sources = Default::default();
    let mut map: Vec<(String, Located)> = Vec::new();
    if let Some(file) = options.get_one::<PathBuf>("params") {
        let name = file.display().to_string();
        let text = linkwork_formats::whole_text(file)
            .map_err(|e| fault(format!("`{name}`: {e}"), None))?;
        let (read, from) = read_value(&name, &text)?;
        let Value::Map(entries) = read.value else {
            let help = "write { \"seed\": 3, \"size\": [50, 50] }";
            return Err(fault(format!("`{name}` does not contain parameters"), Some(help.into())));
        };
        (map, sources) = (entries, from);
    }
    for set in options.get_many::<String>("set").into_iter().flatten() {
        let Some((name, text)) = set.split_once('=') else {
            let help = "write NAME=VALUE, for example --set seed=3";
            return Err(fault(format!("`--set {set}` lacks `=`"), Some(help.into())));
        };
        let name = name.trim().to_string();
        map.retain(|(known, _)| *known != name);
        map.push((name, value(set, text)?));
    }
    let services = Services::default();
    let mut cx = ReadCx::new("terrain", &services);
    let params = GeneratedParams::read_map(&Located::from(Value::Map(map)), &mut cx);
    let Some(params) = params.filter(|_| cx.faults.is_empty()) else {
        return Err(Failure { faults: cx.faults, sources });
    };
    let made = GridTerrain::build(params, &Files::default()).map_err(told)?;
    write(options, &mut made.field())
}

/// Largest number of nodes along an edge of the overview.
const SHOWN: usize = 1024;

fn show(options: &ArgMatches) -> Result<(), Failure> {
    let mut map = open(options)?;
    let grid = map.grid();
    let survey = map.survey(SHOWN).map_err(|e| told(BuildError::of(&e)))?;
    let ([nx, ny], [sx, sy], [x0, y0, x1, y1]) = (grid.size(), grid.spacing(), grid.bounds());
    let [low, high] = survey.range;
    say!("{}", path(options, "from").display());
    say!("nodes     {nx} x {ny}, {sx} m x {sy} m apart");
    say!("x         {x0} to {x1} m, {} m", x1 - x0);
    say!("y         {y0} to {y1} m, {} m", y1 - y0);
    let all = nx as f64 * ny as f64;
    if survey.missing as f64 == all {
        say!("heights   none: no node has data");
        return Ok(());
    }
    match survey.datum {
        0.0 => say!("heights   {low} to {high} m"),
        datum => {
            say!("heights   {:.3} to {:.3} m", datum + f64::from(low), datum + f64::from(high));
        }
    }
    say!("no data   {} nodes, {:.3} %", survey.missing, 100.0 * survey.missing as f64 / all);
    histogram(&survey);
    picture(&survey);
    if let Some(to) = options.get_one::<PathBuf>("picture") {
        let shades = hillshade(&survey.overview, steeper(&survey));
        let pixels: Vec<u8> = shades.iter().map(|s| (s * 255.0) as u8).collect();
        let size = [survey.overview.nx, survey.overview.ny];
        let written = std::fs::File::create(to)
            .and_then(|file| write_shades(&mut BufWriter::new(file), size, &pixels));
        written.map_err(|e| fault(format!("`{}`: {e}", to.display()), None))?;
        say!("{}: {} x {} pixels", to.display(), size[0], size[1]);
    }
    Ok(())
}

/// Prints the share of the nodes of the overview in each of ten height bands.
fn histogram(survey: &Survey) {
    let [low, high] = survey.range.map(f64::from);
    let width = (high - low) / 10.0;
    let known: Vec<f64> =
        survey.overview.heights.iter().filter(|h| !h.is_nan()).map(|h| f64::from(*h)).collect();
    if !(width > 0.0) || known.is_empty() {
        return;
    }
    let mut counts = [0_usize; 10];
    for h in &known {
        counts[(((h - low) / width) as usize).min(9)] += 1;
    }
    let most = counts.iter().max().copied().unwrap_or(1).max(1);
    for (k, count) in counts.iter().enumerate() {
        let bar = "#".repeat((40 * count).div_ceil(most));
        let share = 100.0 * *count as f64 / known.len() as f64;
        say!("  from {:10.3} m  {share:5.1} %  {bar}", survey.datum + low + width * k as f64);
    }
}

/// Returns the factor that exaggerates slopes in the picture: without it, gentle ground would look grey.
fn steeper(survey: &Survey) -> f64 {
    let s = &survey.overview;
    let (mut sum, mut count) = (0.0, 0.0);
    for row in s.heights.chunks_exact(s.nx) {
        for pair in row.windows(2).filter(|p| !p[0].is_nan() && !p[1].is_nan()) {
            sum += (f64::from(pair[1] - pair[0]) / s.spacing[0]).powi(2);
            count += 1.0;
        }
    }
    let slope = (sum / f64::max(count, 1.0)).sqrt();
    if slope > 0.0 { (0.4 / slope).max(1.0) } else { 1.0 }
}

/// Characters, from dark to bright.
const INK: [char; 10] = ['@', '%', '#', '*', '+', '=', '-', ':', '.', ' '];

/// Prints a picture of the map in the terminal, lit from the north-west, with `?` where data is missing.
fn picture(survey: &Survey) {
    let s = &survey.overview;
    let shades = hillshade(s, steeper(survey));
    // A character is twice as high as it is wide.
    let aspect = s.spacing[1] * (s.ny - 1) as f64 / (s.spacing[0] * (s.nx - 1) as f64);
    let wide = s.nx.min(72);
    let high = ((wide as f64 * aspect * 0.5).round() as usize).clamp(1, 40).min(s.ny);
    for line in 0..high {
        let row = line * s.ny / high;
        let ink = |column: usize| {
            let shade = shades[row * s.nx + column * s.nx / wide];
            if shade.is_nan() { '?' } else { INK[((shade * 10.0) as usize).min(9)] }
        };
        say!("  {}", (0..wide).map(ink).collect::<String>().trim_end());
    }
}
