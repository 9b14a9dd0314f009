//! Coefficient files: their content, and errors of invalid ones.

use crate::support::*;
use linkwork_world::gravity::*;
use linkwork_world::spatial::Vec3;

fn fault(format: Format, text: &str) -> String {
    read(format, "field", text, Keep::All).unwrap_err().to_string()
}

/// Sizes and values as printed in the files.
#[test]
fn reference_files_are_read() {
    type Case = (Format, &'static str, f64, f64, usize, usize, usize, f64, f64);
    let cases: [Case; 5] = [
        (
            Format::Basilisk,
            "basilisk_GGM03S.txt",
            0.3986004415E+15,
            6378136.3,
            180,
            180,
            180,
            1.526195665166E-09,
            -1.992132347325E-09,
        ),
        (
            Format::Basilisk,
            "basilisk_GGM2BData.txt",
            4.2828371901284001E+13,
            3.397e6,
            80,
            80,
            80,
            4.0582099786720437E-08,
            -5.3860308941804763E-08,
        ),
        (
            Format::Gmat,
            "gmat_JGM3.cof",
            3.986004415e14,
            6378136.3,
            70,
            70,
            70,
            -6.43069333699900e-10,
            -1.86195961771390e-10,
        ),
        (
            Format::Gmat,
            "gmat_LP165P.cof",
            4.902801056e12,
            1.738e6,
            165,
            165,
            165,
            4.41278012287000e-08,
            -1.46436247594000e-08,
        ),
        (
            Format::Gmat,
            "gmat_Mars50c.cof",
            4.2828370371e13,
            3.3942e6,
            50,
            50,
            50,
            -4.49524473690000e-08,
            8.89533681887000e-08,
        ),
    ];
    for (format, file, mu, radius, degree, n, m, c, s) in cases {
        let Some(text) = reference(&format!("gravity/{file}")) else { return };
        let field = read(format, file, &text, Keep::All).unwrap();
        assert_eq!((field.mu, field.radius), (mu, radius), "{file}");
        assert_eq!((field.degree(), field.order()), (degree, degree), "{file}");
        assert_eq!(field.get(n, m), (c, s), "{file}");
        assert_eq!(field.get(0, 0), (1.0, 0.0), "{file}");
        let cut = read(format, file, &text, Keep::Degree(10)).unwrap();
        assert_eq!(cut, field.truncated(10, 10).unwrap(), "{file}");
        let more = read(format, file, &text, Keep::Degree(degree + 1)).unwrap_err().to_string();
        assert!(more.contains(&format!("the field has degree {degree}, not {}", degree + 1)));
    }
}

/// Every coefficient of every file, read independently by columns: degree, order, C̄, S̄.
#[test]
fn every_coefficient_is_where_it_belongs() {
    let gmat = |line: &str| {
        let rest = line.strip_prefix("RECOEF")?;
        let number = |a: usize, b: usize| {
            rest.get(a..b.min(rest.len())).map_or(Ok(0.0), |x| match x.trim() {
                "" => Ok(0.0),
                x => x.parse::<f64>(),
            })
        };
        Some([number(0, 5), number(5, 8), number(8, 32), number(32, 53)].map(Result::unwrap))
    };
    let basilisk = |line: &str| {
        let words: Vec<f64> = line.split(',').map(|w| w.trim().parse().unwrap()).collect();
        (words.len() == 6).then(|| [words[0], words[1], words[2], words[3]])
    };
    type Columns<'a> = &'a dyn Fn(&str) -> Option<[f64; 4]>;
    let cases: [(Format, &str, usize, Columns<'_>); 5] = [
        (Format::Basilisk, "basilisk_GGM03S.txt", 16_471, &basilisk),
        (Format::Basilisk, "basilisk_GGM2BData.txt", 3318, &basilisk),
        (Format::Gmat, "gmat_JGM3.cof", 0, &gmat),
        (Format::Gmat, "gmat_LP165P.cof", 0, &gmat),
        (Format::Gmat, "gmat_Mars50c.cof", 0, &gmat),
    ];
    for (format, file, rows, columns) in cases {
        let Some(text) = reference(&format!("gravity/{file}")) else { return };
        let field = read(format, file, &text, Keep::All).unwrap();
        let mut count = 0;
        for [n, m, c, s] in text.lines().filter_map(columns) {
            let (n, m) = (n as usize, m as usize);
            assert_eq!(field.get(n, m), (c, s), "{file}: {n}, {m}");
            count += 1;
        }
        let degree = field.degree();
        assert!(count >= (degree + 1) * (degree + 2) / 2 - 4, "{file}: {count}");
        assert!(rows == 0 || rows == count, "{file}: {count}");
    }
}

/// JGM-3 and GGM03S describe one planet: 20 × 20 they differ by some 2e-6 m/s² at 400 km.
#[test]
fn two_files_of_the_earth_agree() {
    let (Some(a), Some(b)) =
        (reference("gravity/gmat_JGM3.cof"), reference("gravity/basilisk_GGM03S.txt"))
    else {
        return;
    };
    let field = |f, t: &str| Harmonics::new(&read(f, "", t, Keep::Degree(20)).unwrap());
    let (a, b) = (field(Format::Gmat, &a), field(Format::Basilisk, &b));
    let mut random = Random(1);
    for _ in 0..20 {
        let p = random.on_sphere(6.78e6);
        let d = (a.acceleration(&p) - b.acceleration(&p)).norm();
        assert!(d < 5e-6 && d > 1e-9, "{d:e}");
    }
}

/// One small field of degree 2 in four formats, once without normalisation.
#[test]
fn four_formats_say_the_same() {
    let gmat = "COMMENT   1\nCCC\n\
        POTFIELD  2  2  0 4.00000000000000e+14 6.40000000000000e+06 1.00000000000000e+00\n\
        RECOEF    2  0   -4.84000000000000e-04\n\
        RECOEF    2  1   -2.00000000000000e-10-1.50000000000000e-09\n\
        RECOEF    2  2    2.43000000000000e-06-1.40000000000000e-06\nEND \n";
    let basilisk = "6.4e6, 4.0e14, 7.3e-5, 2, 2, 1, 0.0, 0.0\n2,0,-4.84E-04,0,0,0\n\
        2, 1, -2.0D-10, -1.5D-09\n2,2,2.43E-06,-1.40E-06,1e-9,1e-9\n";
    let shadr = "6.4e3, 4.0e5, 0.001, 2, 2, 1, 0.0, 0.0\n2,0,-4.84E-04,0,0,0\n\
        2,1,-2.0E-10,-1.5E-09,0,0\n2,2,2.43E-06,-1.40E-06,1e-9,1e-9\n";
    let icgem = "a text\nproduct_type gravity_field\nearth_gravity_constant 4.0e14\nradius 6.4e6\n\
        max_degree 2\nnorm fully_normalized\ntide_system zero_tide\nend_of_head ====\n\
        gfc 0 0 1.0 0.0\ngfc 2 0 -4.84E-04 0 0 0\ngfc 2 1 -2.0D-10 -1.5D-09\n\
        gfc 2 2 2.43E-06 -1.40E-06\n";
    // C = N C̄, where N² is 5, 5/3 and 5/12 for orders 0, 1 and 2.
    let (k0, k1, k2) = (5f64.sqrt(), (5.0_f64 / 3.0).sqrt(), (5.0_f64 / 12.0).sqrt());
    let bare = format!(
        "radius 6.4e6\nearth_gravity_constant 4.0e14\nmax_degree 2\nnorm unnormalized\nend_of_head\n\
         gfc 2 0 {:e} 0\ngfc 2 1 {:e} {:e}\ngfc 2 2 {:e} {:e}\n",
        -4.84e-4 * k0,
        -2e-10 * k1,
        -1.5e-9 * k1,
        2.43e-6 * k2,
        -1.4e-6 * k2
    );
    let first = read(Format::Gmat, "a", gmat, Keep::All).unwrap();
    assert_eq!(first.get(2, 1), (-2e-10, -1.5e-9));
    for (format, text) in [
        (Format::Basilisk, basilisk),
        (Format::Shadr, shadr),
        (Format::Icgem, icgem),
        (Format::Icgem, bare.as_str()),
    ] {
        let field = read(format, "b", text, Keep::All).unwrap();
        relative(field.mu, first.mu, 1e-15, "mu");
        relative(field.radius, first.radius, 1e-15, "radius");
        for (n, m) in [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2)] {
            let ((c, s), (c0, s0)) = (field.get(n, m), first.get(n, m));
            relative(c, c0, 1e-15, &format!("{format:?} C {n} {m}"));
            relative(s, s0, 1e-15, &format!("{format:?} S {n} {m}"));
        }
    }
    assert_eq!(read(Format::Icgem, "", icgem, Keep::All).unwrap().tide, TideSystem::ZeroTide);
    let point = Harmonics::new(&first).acceleration(&Vec3::new(7e6, 0.0, 0.0));
    assert!((point.x + 8.16).abs() < 0.05, "{point:?}");
}

#[test]
fn wrong_gmat_files_are_refused() {
    let head = "POTFIELD  2  2  0 4.00000000000000e+14 6.40000000000000e+06 1.00000000000000e+00\n";
    let rows = "RECOEF    2  0   -4.84000000000000e-04\nRECOEF    2  1   -2.00000000000000e-10-1.50000000000000e-09\n\
        RECOEF    2  2    2.43000000000000e-06-1.40000000000000e-06\n";
    let cases = [
        (format!("{head}{rows}"), "field:0: there is no END\n  help: the file was truncated"),
        (format!("{rows}END"), "field:1: RECOEF before POTFIELD"),
        ("END".to_string(), "there is no POTFIELD"),
        (format!("{head}{head}{rows}END"), "field:2: a second POTFIELD; the first is on line 1"),
        (format!("{head}{rows}{rows}END"), "field:5: degree 2, order 0 is already on line 2"),
        (format!("{head}WHAT\nEND"), "field:2: `WHAT` is not a keyword"),
        (
            format!("{head}RECOEF    3  0   -4.8e-04\nEND"),
            "field:2: degree 3, order 0 in a field of degree 2, order 2",
        ),
        (format!("{head}RECOEF    2  0   -4.8x-04\nEND"), "field:2: C is `-4.8x-04`"),
        (format!("{head}RECOEF    2  1   -4.80000000000000e-04\nEND"), "field:2: S is ``"),
        (
            format!("{head}RECOEF    2  0   -4.84000000000000e-04\nEND"),
            "degree 2, the last, has 1 of its 3 orders",
        ),
        (
            head.replace("4.00000000000000e+14", "-4.0000000000000e+14") + rows + "END",
            "field:1: `mu, m³/s²` is -4",
        ),
        (
            head.replace("1.00000000000000e+00", "") + rows + "END",
            "POTFIELD has 3 numbers after the order, not 4",
        ),
    ];
    for (text, expected) in cases {
        let message = fault(Format::Gmat, &text);
        assert!(message.contains(expected), "{message}\nhas no `{expected}`");
        assert!(message.contains("\n  help: "), "{message}");
    }
}

#[test]
fn wrong_lists_are_refused() {
    let head = "6.4e6, 4.0e14, 7.3e-5, 2, 2, 1, 0.0, 0.0\n";
    let cases = [
        ("".to_string(), "field:0: the file is empty"),
        ("1, 2, 3\n".to_string(), "field:1: the header has 3 numbers, not 8"),
        (head.replace("1, 0.0, 0.0", "2, 0.0, 0.0"), "normalisation is 2"),
        (head.replace("0.0, 0.0", "10.0, 0.0"), "reference longitude is 10.0, not 0"),
        (format!("{head}2,0,1e-3\n"), "field:2: 3 numbers, not 4 or 6"),
        (format!("{head}2.5,0,1e-3,0\n"), "field:2: degree is `2.5`, which is not an integer"),
        (format!("{head}0,0,0.5,0\n"), "C of degree 0 is 0.5, not 1"),
        (format!("{head}2,0,1e-3,0\n"), "degree 2, the last, has 1 of its 3 orders"),
    ];
    for (text, expected) in cases {
        let message = fault(Format::Basilisk, &text);
        assert!(message.contains(expected), "{message}\nhas no `{expected}`");
    }
    let metres = fault(Format::Shadr, head);
    assert!(metres.contains("larger than Jupiter's") && metres.contains("Basilisk"), "{metres}");
}

/// Zeros may be omitted: a field with only zonal terms has order 0. A truncated list is still rejected.
#[test]
fn icgem_files_may_have_zonal_terms_alone() {
    let head = "earth_gravity_constant 4.0e14\nradius 6.4e6\nmax_degree 4\nend_of_head\n";
    let zonal = format!("{head}gfc 2 0 -4.8e-4 0\ngfc 3 0 9.6e-7 0\ngfc 4 0 5.4e-7 0\n");
    for keep in [Keep::All, Keep::Degree(4)] {
        let field = read(Format::Icgem, "z", &zonal, keep).unwrap();
        assert_eq!((field.degree(), field.order(), field.get(4, 0)), (4, 0, (5.4e-7, 0.0)));
    }
    let cut =
        format!("{head}gfc 2 0 -4.8e-4 0\ngfc 3 0 9.6e-7 0\ngfc 3 1 2e-6 2e-7\ngfc 4 0 5.4e-7 0\n");
    assert!(fault(Format::Icgem, &cut).contains("degree 4, the last, has 1 of its 2 orders"));
    let shorter = format!("{head}gfc 2 0 -4.8e-4 0\ngfc 3 0 9.6e-7 0\n");
    assert!(fault(Format::Icgem, &shorter).contains("degree 4, the last, has 0 of its 1 orders"));
}

#[test]
fn wrong_icgem_files_are_refused() {
    let head = "earth_gravity_constant 4.0e14\nradius 6.4e6\nmax_degree 2\nend_of_head\n";
    let cases = [
        ("radius 6.4e6\n".to_string(), "`end_of_head` is missing"),
        (head.replace("radius 6.4e6\n", ""), "field:3: the header has no `radius`"),
        (head.replace("max_degree 2\n", ""), "the header has no `max_degree`"),
        (format!("norm half\n{head}"), "field:1: norm is `half`"),
        (
            format!("{head}gfct 2 0 1e-3 0 0 0 20050101\n"),
            "field:5: `gfct`: the field changes with time",
        ),
        (format!("{head}abc 2 0\n"), "field:5: `abc 2 0` is not a line of a list"),
        (
            head.replace("max_degree 2", "max_degree 2190"),
            "the field has degree 2190\n  help: keep at most 360",
        ),
    ];
    for (text, expected) in cases {
        let message = fault(Format::Icgem, &text);
        assert!(message.contains(expected), "{message}\nhas no `{expected}`");
    }
}

/// Any content is read or rejected, but never panics.
#[test]
fn bent_files_do_no_harm() {
    let gmat = "COMMENT   1\nPOTFIELD  2  2  0 4.00000000000000e+14 6.40000000000000e+06 1.00000000000000e+00\n\
        RECOEF    2  0   -4.84000000000000e-04\nRECOEF    2  1   -2.00000000000000e-10-1.50000000000000e-09\n\
        RECOEF    2  2    2.43000000000000e-06-1.40000000000000e-06\nEND \n";
    let list = "6.4e3, 4.0e5, 0.001, 2, 2, 1, 0.0, 0.0\n2,0,-4.84E-04,0,0,0\n2,1,-2.0E-10,-1.5E-09\n2,2,2e-6,1e-6\n";
    let icgem = "earth_gravity_constant 4e14\nradius 6.4e6\nmax_degree 2\nend_of_head\ngfc 2 0 1e-4 0\n\
        gfc 2 1 1e-9 1e-9\ngfc 2 2 1e-6 1e-6\n";
    let files = [
        (Format::Gmat, gmat),
        (Format::Basilisk, list),
        (Format::Shadr, list),
        (Format::Icgem, icgem),
    ];
    let signs: Vec<char> = "0123456789 ,.-+eED\nµ".chars().collect();
    let mut random = Random(5);
    for (format, text) in files {
        assert!(read(format, "whole", text, Keep::All).is_ok(), "{format:?}");
        for k in 0..4000 {
            let mut bent: Vec<char> = text.chars().collect();
            for _ in 0..=k % 3 {
                let at = random.next() as usize % bent.len();
                let sign = signs[random.next() as usize % signs.len()];
                match random.next() % 3 {
                    0 => bent[at] = sign,
                    1 => bent.insert(at, sign),
                    _ => drop(bent.drain(at..(at + 9).min(bent.len()))),
                }
            }
            let bent: String = bent.into_iter().collect();
            for keep in [Keep::All, Keep::Degree(2)] {
                let _ = read(format, "bent", &bent, keep);
            }
        }
    }
    let huge = icgem.replace("max_degree 2", "max_degree 18446744073709551615");
    let message = read(Format::Icgem, "huge", &huge, Keep::Degree(2)).unwrap_err().to_string();
    assert!(message.contains("fields of this size do not exist"), "{message}");
}

/// A header that states the wrong normalisation, in both directions.
#[test]
fn wrong_normalisation_is_noticed() {
    let Some(text) = reference("gravity/gmat_JGM3.cof") else { return };
    let lie = text.replace(
        "6.37813630000000e+06 1.00000000000000e+00",
        "6.37813630000000e+06 0.00000000000000e+00",
    );
    assert_ne!(lie, text);
    let message = fault(Format::Gmat, &lie);
    assert!(message.contains("the header states no normalisation"), "{message}");
    let field = read(Format::Gmat, "", &text, Keep::Degree(20)).unwrap();
    let mut bare =
        "radius 6378136.3\nearth_gravity_constant 3.986e14\nmax_degree 20\nend_of_head\n"
            .to_string();
    for n in 2..=20 {
        for m in 0..=n {
            let ((c, s), k) = (field.get(n, m), normalisation(n, m));
            bare += &format!("gfc {n} {m} {:e} {:e}\n", c * k, s * k);
        }
    }
    let message = fault(Format::Icgem, &bare);
    assert!(message.contains("the header states normalisation, but"), "{message}");
    let honest = bare.replace("end_of_head", "norm unnormalized\nend_of_head");
    let again = read(Format::Icgem, "", &honest, Keep::All).unwrap();
    relative(again.get(20, 20).0, field.get(20, 20).0, 1e-14, "there and back");
}
