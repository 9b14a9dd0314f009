//! NAIF's text kernels of planetary constants (PCK): pole, prime meridian, radii and gravitational parameter of any body.
//!
//! ```text
//! \begindata  BODY499_POLE_RA = ( 317.68143 -0.1061 0. )  ..  NAME += ( .. )  ..  \begintext
//! α = Σ POLE_RA[k] Tᵏ + Σ NUT_PREC_RA[i] sin Eᵢ      δ = Σ POLE_DEC[k] Tᵏ + Σ NUT_PREC_DEC[i] cos Eᵢ
//! W = Σ PM[k] dᵏ + Σ NUT_PREC_PM[i] sin Eᵢ           Eᵢ = polynomial of NUT_PREC_ANGLES of the barycentre in T
//! ```
//! NAIF, *PCK Required Reading* and *Kernel Required Reading*. [`PckKernel`](super::PckKernel) reads binary kernels.

use super::iau::{IauRotation, IauTerm};
use crate::error::{WorldError, plain};
use std::collections::BTreeMap;

/// Values of a text kernel, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PckConstants {
    file: String,
    values: BTreeMap<String, Vec<f64>>,
}

/// Maximum number of values of a kernel.
const VALUES_MAX: usize = 1 << 20;

impl PckConstants {
    /// Reads a text kernel. Skips texts and dates among its values.
    ///
    /// # Errors
    /// A binary kernel, a text without data, or a value that is not a number, text or date.
    pub fn read(file: &str, text: &str) -> Result<Self, WorldError> {
        let wrong = |line: usize, fact: String, help: &'static str| WorldError::Line {
            file: file.to_string(),
            line,
            fact,
            help,
        };
        let text = plain(text);
        if text.starts_with("DAF/") {
            let fact = "this is a binary kernel".to_string();
            return Err(wrong(1, fact, "read its bytes, or use a text kernel (.tpc)"));
        }
        let mut out = Self { file: file.into(), values: BTreeMap::new() };
        let (mut data, mut name, mut count) = (false, None::<String>, 0);
        for (k, raw) in text.lines().enumerate() {
            match raw.trim().to_ascii_lowercase().as_str() {
                "\\begindata" => data = true,
                "\\begintext" => data = false,
                _ if data => {
                    for word in words(raw) {
                        match word {
                            Word::Name(n, replace) => {
                                let values = out.values.entry(n.clone()).or_default();
                                if replace {
                                    values.clear();
                                }
                                name = Some(n);
                            }
                            Word::Other => {}
                            Word::Value(text) => {
                                let number = text.replace(['D', 'd'], "E").parse::<f64>().ok();
                                let number = number.filter(|x| x.is_finite());
                                let Some((number, name)) = number.zip(name.as_ref()) else {
                                    let fact = format!("`{text}` is not a number of a variable");
                                    let help =
                                        "values are numbers, 'texts' and @dates, after NAME =";
                                    return Err(wrong(k + 1, fact, help));
                                };
                                count += 1;
                                if count > VALUES_MAX {
                                    let fact = format!("more than {VALUES_MAX} values");
                                    return Err(wrong(k + 1, fact, "use a smaller kernel"));
                                }
                                out.values.entry(name.clone()).or_default().push(number);
                            }
                        }
                    }
                }
                _ => {}
            }
        }
        if out.values.is_empty() {
            let fact = "no variable between \\begindata and \\begintext".to_string();
            return Err(wrong(0, fact, "give a text kernel of NAIF (.tpc)"));
        }
        Ok(out)
    }

    /// Returns the values of `BODYnnn_NAME`.
    #[must_use]
    pub fn get(&self, body: u32, name: &str) -> Option<&[f64]> {
        self.values.get(&format!("BODY{body}_{name}")).map(Vec::as_slice)
    }

    /// Returns the radii along x, y, z of the body, m.
    #[must_use]
    pub fn radii(&self, body: u32) -> Option<[f64; 3]> {
        let [x, y, z] = *self.get(body, "RADII")? else { return None };
        Some([x, y, z].map(|r| r * 1e3))
    }

    /// Returns the gravitational parameter of the body, m³/s².
    #[must_use]
    pub fn gravity_parameter(&self, body: u32) -> Option<f64> {
        self.get(body, "GM")?.first().map(|gm| gm * 1e9)
    }

    /// Returns pole and prime meridian of a body by NAIF's number; `tdb_days` past J2000 (whole, fraction) is the epoch of t = 0.
    ///
    /// # Errors
    /// Constants are missing, or have another length than in SPICE.
    pub fn rotation(&self, body: u32, tdb_days: (f64, f64)) -> Result<IauRotation, WorldError> {
        let wrong = |fact: String, help: &'static str| WorldError::Line {
            file: self.file.clone(),
            line: 0,
            fact,
            help,
        };
        let polynomial = |name: &str| -> Result<[f64; 3], WorldError> {
            let help = "write one to three numbers, or use a kernel with this body";
            match self.get(body, name) {
                Some(list) if (1..=3).contains(&list.len()) => {
                    let mut out = [0.0; 3];
                    out[..list.len()].copy_from_slice(list);
                    Ok(out)
                }
                Some(list) => {
                    Err(wrong(format!("BODY{body}_{name} has {} numbers", list.len()), help))
                }
                None => Err(wrong(format!("BODY{body}_{name} is missing"), help)),
            }
        };
        // The periodic angles are stored for the barycentre of the system of the body.
        let system = if body < 1000 { body / 100 } else { body };
        let degree = self.get(system, "MAX_PHASE_DEGREE").and_then(|d| d.first().copied());
        let degree = degree.unwrap_or(1.0);
        if degree != 1.0 && degree != 2.0 {
            let fact = format!("BODY{system}_MAX_PHASE_DEGREE is {degree}");
            return Err(wrong(fact, "degrees 1 and 2 are read"));
        }
        let angles = self.get(system, "NUT_PREC_ANGLES").unwrap_or_default();
        let angles: Vec<&[f64]> = angles.chunks_exact(degree as usize + 1).collect();
        let list = |name: &str| self.get(body, name).unwrap_or_default();
        let (ra, dec, pm) = (list("NUT_PREC_RA"), list("NUT_PREC_DEC"), list("NUT_PREC_PM"));
        let most = ra.len().max(dec.len()).max(pm.len());
        if most > angles.len() {
            let fact = format!(
                "BODY{body} has {most} periodic terms and BODY{system} {} angles",
                angles.len()
            );
            return Err(wrong(fact, "use a kernel with NUT_PREC_ANGLES of the system of the body"));
        }
        let century = 36525.0_f64;
        let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(0.0);
        let term = |k: usize| IauTerm {
            angle_deg: [
                at(angles[k], 0),
                at(angles[k], 1) / century,
                at(angles[k], 2) / (century * century),
            ],
            ra_dec_w_deg: [at(ra, k), at(dec, k), at(pm, k)],
        };
        let terms: Vec<IauTerm> = (0..most).map(term).collect();
        let (pole_ra, pole_dec, meridian) =
            (polynomial("POLE_RA")?, polynomial("POLE_DEC")?, polynomial("PM")?);
        Ok(IauRotation::new(pole_ra, pole_dec, meridian, &terms, tdb_days))
    }
}

/// A token of a data line.
enum Word {
    /// A variable, and whether its values are replaced (`=`) or appended to (`+=`).
    Name(String, bool),
    /// A text or a date.
    Other,
    Value(String),
}

fn words(line: &str) -> Vec<Word> {
    let mut out = Vec::new();
    let mut rest = line;
    if let Some((left, right)) = line.split_once('=').filter(|(l, _)| !l.contains('\'')) {
        let add = left.ends_with('+');
        let name = left.trim_end_matches('+').trim();
        out.push(Word::Name(name.to_string(), !add));
        rest = right;
    }
    // Every second piece between apostrophes is a text.
    for (k, piece) in rest.split('\'').enumerate() {
        if k % 2 == 1 {
            out.push(Word::Other);
            continue;
        }
        let separate = |c: char| c.is_whitespace() || "(),".contains(c);
        for word in piece.split(separate).filter(|w| !w.is_empty()) {
            out.push(match word.starts_with('@') {
                true => Word::Other,
                false => Word::Value(word.to_string()),
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::Vec3;

    const KERNEL: &str = "KPL/PCK
Some words before the data: BODY499_RADII = ( 1 1 1 ) is not data here.
\\begindata
BODY499_RADII      = ( 3396.19   3396.19   3376.20 )
BODY499_POLE_RA    = (  317.68143   -0.1061      0.  )
BODY499_POLE_DEC   = (   52.88650   -0.0609      0.  )
BODY499_PM         = (  176.630    350.89198226  0.  )
BODY4_NUT_PREC_ANGLES = ( 169.51 -15916.2801, 192.93  41215163.19675
                           53.47   -662.965275 )
BODY401_POLE_RA    = (  317.68     -0.108       0.02  )
BODY401_POLE_DEC   = (   52.90     -0.061       0.  )
BODY401_PM         = (   35.06   1128.8445850  6.6443009930565219D-09 )
\\begintext
more words
\\begindata
BODY401_NUT_PREC_RA  = (   1.79    0.    0. )
BODY401_NUT_PREC_DEC = (  -1.08    0.    0. )
BODY401_NUT_PREC_PM  = (  -1.42   -0.78 )
BODY401_NUT_PREC_PM += 0.3
BODY401_RADII        = ( 13.0 11.4 9.1 )
BODY499_GM = ( 4.282837362069909E+04 )
FRAME_NAME = 'IAU = PHOBOS'
KERNEL_DATE = @2020-JAN-01
\\begintext
";

    /// Compares with `sxform` of spiceypy 8.3 for this kernel: rows of the rotation from the body to J2000, and the angular velocity (rad/s).
    #[test]
    fn bodies_turn_as_in_spice() {
        let pck = PckConstants::read("h.tpc", KERNEL).unwrap();
        let cases: [(u32, f64, [f64; 9], [f64; 3]); 3] = [
            (
                499,
                86_401_234.5,
                [
                    -0.375_879_342_390_442_74,
                    -0.812_194_667_984_012,
                    0.446_155_288_282_531_76,
                    0.723_558_645_827_134_5,
                    -0.558_034_777_417_757_9,
                    -0.406_275_858_550_710_3,
                    0.578_945_253_036_011_6,
                    0.170_108_813_677_169_97,
                    0.797_424_219_281_314_7,
                ],
                [3.162_445_997_458_616e-5, -2.879_771_855_578_911e-5, 5.652_316_698_938_243e-5],
            ),
            (
                401,
                0.0,
                [
                    0.200_027_447_380_016_27,
                    -0.876_813_619_190_231_8,
                    0.437_249_239_561_559_3,
                    0.919_175_750_513_693_3,
                    0.013_401_405_290_532_63,
                    -0.393_619_539_662_130_7,
                    0.339_271_218_882_804_2,
                    0.480_643_609_693_051_03,
                    0.808_626_465_371_379_3,
                ],
                [1.010_289_779_680_394_7e-4, -9.094_767_532_109_731e-5, 1.868_401_736_485_909_2e-4],
            ),
            (
                401,
                86_401_234.5,
                [
                    0.820_332_321_038_130_1,
                    0.342_873_516_643_697_9,
                    0.457_703_653_737_413_45,
                    -0.160_341_178_364_942_5,
                    0.906_133_563_481_716_5,
                    -0.391_423_902_760_763_8,
                    -0.548_949_532_817_668,
                    0.247_708_935_479_344_25,
                    0.798_307_392_990_290_5,
                ],
                [1.030_274_002_877_246_7e-4, -8.810_589_431_368_701e-5, 1.796_943_442_304_191_2e-4],
            ),
        ];
        for (body, et, rows, omega) in cases {
            // The angle must not depend on the epoch of the simulation.
            for start in [0.0, 500.0] {
                let spin = pck.rotation(body, (start, 0.0)).unwrap().at(et - start * 86_400.0);
                let R = spin.R_IP.to_rotation_matrix().into_inner();
                for (k, want) in rows.iter().enumerate() {
                    let own = R[(k / 3, k % 3)];
                    assert!((own - want).abs() < 2e-11, "{body} {et} {k}: {own} {want}");
                }
                let error = (spin.omega_I - Vec3::from(omega)).norm() / Vec3::from(omega).norm();
                assert!(error < 1e-10, "{body} {et}: {error:e}");
            }
        }
        assert_eq!(pck.radii(401), Some([13_000.0, 11_400.0, 9_100.0]));
        assert_eq!(pck.gravity_parameter(499), Some(4.282_837_362_069_909e4 * 1e9));
    }

    #[test]
    fn kernels_that_cannot_be_used_are_refused() {
        for (text, part) in [
            ("DAF/PCK \u{0}", "binary kernel"),
            ("KPL/PCK\nno data", "no variable between"),
            ("\\begindata\nA = ( 1 x )", "`x` is not a number"),
            ("\\begindata\n( 1 2 )", "`1` is not a number of a variable"),
        ] {
            let error = PckConstants::read("h.tpc", text).unwrap_err().to_string();
            assert!(error.contains(part), "{part}: {error}");
        }
        let pck = PckConstants::read("h.tpc", KERNEL).unwrap();
        let error =
            |pck: &PckConstants, body| pck.rotation(body, (0.0, 0.0)).unwrap_err().to_string();
        assert!(error(&pck, 402).contains("BODY402_POLE_RA is missing"));
        let few = KERNEL.replace("192.93  41215163.19675", "").replace("53.47   -662.965275", "");
        let few = PckConstants::read("h.tpc", &few).unwrap();
        assert!(error(&few, 401).contains("3 periodic terms and BODY4 1 angles"));
    }
}
