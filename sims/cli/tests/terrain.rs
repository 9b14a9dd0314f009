//! `linkwork terrain`: maps are created, shown, converted and resampled; bad files are rejected with a remedy.
use crate::common::Lab;

const SMALL: [&str; 8] = [
    "--set",
    "size=[20, 10]",
    "--set",
    "spacing=\"25 cm\"",
    "--set",
    "relief=0",
    "--set",
    "slope=[0.1, 0]",
];

#[test]
fn a_map_is_made_shown_converted_and_resampled() {
    let lab = Lab::new();
    let step = "landforms=[{\"kind\": \"step\", \"at\": [5, 0], \"length\": 2, \"width\": 2, \"height\": 0.5}]";
    let make = [&["terrain", "make", "a.tif"], &SMALL[..], &["--set", step]].concat();
    let said = lab.linkwork(&make).code(0).out;
    assert!(said.contains("a.tif: 81 x 41 nodes, 0.25 m x 0.25 m apart"), "{said}");
    let said = lab.linkwork(&["terrain", "show", "a.tif", "--picture", "a.png"]).code(0).out;
    for wanted in [
        "81 x 41, 0.25 m x 0.25 m apart",
        "-10 to 10 m, 20 m",
        "-5 to 5 m, 10 m",
        "heights   -1 to 1.2 m",
        "no data   0 nodes",
        "a.png: 81 x 41 pixels",
    ] {
        assert!(said.contains(wanted), "{wanted}\n{said}");
    }
    // The output has ten bands that contain all nodes, and a picture of the right width.
    let shares = said
        .lines()
        .filter_map(|l| l.split('%').next()?.rsplit("m  ").next()?.trim().parse::<f64>().ok());
    let shares: Vec<f64> = shares.collect();
    assert!(shares.len() == 10 && (shares.iter().sum::<f64>() - 100.0).abs() < 0.6, "{said}");
    assert_eq!(&std::fs::read(lab.path("a.png")).unwrap()[1..4], b"PNG");

    lab.linkwork(&["terrain", "convert", "a.tif", "a.tiles", "--tile", "16"]).code(0);
    lab.linkwork(&["terrain", "convert", "a.tiles", "a.asc"]).code(0);
    let heights = |name: &str| {
        let said = lab.linkwork(&["terrain", "show", name]).code(0).out;
        said.lines().skip(1).take(5).map(str::to_string).collect::<Vec<_>>()
    };
    assert_eq!(heights("a.tiles"), heights("a.tif"));
    assert_eq!(heights("a.asc"), heights("a.tif"));
    let said = lab.linkwork(&["terrain", "convert", "a.asc", "b.png"]).code(0).out;
    assert!(said.contains("--spacing 0.25,0.25 --range -1,1.2"), "{said}");
    let back =
        ["terrain", "convert", "b.png", "b.asc", "--spacing", "0.25,0.25", "--range", "-1,1.2"];
    lab.linkwork(&back).code(0);
    let numbers = |name: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(lab.path(name)).unwrap();
        let rows = text.lines().filter(|l| l.split_whitespace().count() > 2);
        rows.flat_map(|l| l.split_whitespace().map(|w| w.parse().unwrap()).collect::<Vec<f64>>())
            .collect()
    };
    let (a, b) = (numbers("a.asc"), numbers("b.asc"));
    assert!(a.len() == 81 * 41 && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 2.2 / 65535.0));

    let finer = ["terrain", "resample", "a.tiles", "c.tif", "--to-spacing", "0.1"];
    let said = lab.linkwork(&finer).code(0).out;
    assert!(said.contains("c.tif: 201 x 101 nodes, 0.1 m x 0.1 m apart"), "{said}");
}

/// The halves of a map, in different formats, are merged into the same map.
#[test]
fn a_map_is_cropped_and_its_parts_are_merged() {
    let lab = Lab::new();
    lab.linkwork(&[&["terrain", "make", "a.tif"], &SMALL[..]].concat()).code(0);
    let crop = |to: &str, within: &str| {
        lab.linkwork(&["terrain", "crop", "a.tif", to, "--within", within]).code(0).out
    };
    let said = crop("west.tif", "-10,-5,0,5");
    assert!(said.contains("west.tif: 41 x 41 nodes, 0.25 m x 0.25 m apart"), "{said}");
    let said = crop("east.asc", "0,-9,10.1,5");
    assert!(said.contains("east.asc: 41 x 41 nodes"), "{said}");
    let merged = ["terrain", "merge", "west.tif", "east.asc", "--out", "b.tif"];
    let said = lab.linkwork(&merged).code(0).out;
    assert!(said.contains("b.tif: 81 x 41 nodes"), "{said}");
    for name in ["a", "b"] {
        let (from, to) = (format!("{name}.tif"), format!("{name}.asc"));
        lab.linkwork(&["terrain", "convert", &from, &to]).code(0);
    }
    let text = |name: &str| std::fs::read_to_string(lab.path(name)).unwrap();
    assert_eq!(text("a.asc"), text("b.asc"));
    lab.write(
        "other.asc",
        "ncols 2\nnrows 2\nxllcenter 0.1\nyllcenter 0\ncellsize 0.25\n1 2\n3 4\n",
    );
    for (args, wanted) in [
        (
            vec!["crop", "a.tif", "c.tif", "--within", "20,0,30,5"],
            "the map extends from x = -10 to 10 m",
        ),
        (vec!["crop", "a.tif", "c.tif", "--within", "0,1,2"], "is not four numbers"),
        (vec!["merge", "a.tif", "other.asc", "--out", "c.tif"], "have different nodes"),
    ] {
        lab.linkwork(&[&["terrain"], &args[..]].concat()).code(2).tells(&[wanted]);
    }
    assert!(!lab.path("c.tif").exists());
}

#[test]
fn parameters_come_from_a_file_and_are_replaced() {
    let lab = Lab::new();
    lab.write("yard.ron", "{\"size\": [6, 4], \"spacing\": 0.5, \"relief\": 0.2, \"seed\": 4}");
    lab.linkwork(&["terrain", "make", "a.asc", "yard.ron"]).code(0);
    lab.linkwork(&["terrain", "make", "b.asc", "yard.ron", "--set", "seed=5"]).code(0);
    lab.linkwork(&["terrain", "make", "c.asc", "yard.ron"]).code(0);
    let text = |name: &str| std::fs::read_to_string(lab.path(name)).unwrap();
    assert!(text("a.asc").starts_with("ncols 13\nnrows 9\n"));
    assert_eq!(text("a.asc"), text("c.asc"));
    assert_ne!(text("a.asc"), text("b.asc"));
}

#[test]
fn what_is_no_map_is_refused_with_the_remedy_and_leaves_nothing() {
    let lab = Lab::new();
    lab.write("a.asc", "ncols 2\nnrows 2\ncellsize 1\n1 2\n3 4\n");
    lab.write("d.asc", "ncols 2\nnrows 2\ncellsize 1\n1 2\n3 4\n");
    lab.write("d.prj", "GEOGCS[\"x\",UNIT[\"Degree\",0.0174]]");
    lab.write("yard.ron", "{\"size\": [6, 4], \"spacing\": 0.5,\n \"sead\": 4}");
    lab.write("t.tiles", "LWTILES1 and no more");
    for (args, wanted) in [
        (vec!["show", "none.asc"], vec!["none.asc", "name an existing map"]),
        (vec!["show", "t.tiles"], vec!["it ends within its head", "linkwork terrain convert"]),
        (vec!["show", "d.asc"], vec!["a degree is not a length", "--spacing 30", "gdalwarp"]),
        (vec!["show", "a.asc", "--spacing", "one"], vec!["`--spacing one`", "write --spacing 0.5"]),
        (vec!["convert", "a.asc", "b.bmp"], vec!["not written", ".tiles"]),
        (vec!["convert", "a.asc", "nowhere/b.tif"], vec!["nowhere/b.tif"]),
        (
            vec!["convert", "a.asc", "b.tiles", "--tile", "5"],
            vec!["tiles of 5 cells", "16 to 1024"],
        ),
        (vec!["resample", "a.asc", "b.asc", "--to-spacing", "0"], vec!["node spacing is 0 m"]),
        (vec!["make", "b.tif", "yard.ron"], vec!["sead", "did you mean `seed`?", "yard.ron:2:"]),
        (vec!["make", "b.tif", "--set", "seed"], vec!["write NAME=VALUE"]),
        (vec!["make", "b.tif", "--set", "size=[1, 2"], vec!["size=[1, 2"]),
        (vec!["make", "b.tif", "--set", "spacing=1e-3"], vec!["million nodes are too many"]),
        (
            vec!["make", "b.tif", "--set", "dunes={\"height\": 9, \"wavelength\": 10}"],
            vec!["steeper than `lee` allows"],
        ),
    ] {
        let said = lab.linkwork(&[&["terrain"], &args[..]].concat()).code(2);
        said.tells(&wanted);
    }
    assert_eq!(lab.files(), ["a.asc", "d.asc", "d.prj", "t.tiles", "yard.ron"]);
}
