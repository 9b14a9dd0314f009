//! Lenses: projection and ray are inverses, models agree where they must, and values computed elsewhere.

use linkwork_render::spatial::Vec3;
use linkwork_render::{Brown, Cahv, Cahvor, Cahvore, Lens};

fn brown() -> Brown {
    Brown {
        focal: [410.0, 405.0],
        centre: [318.3, 241.7],
        radial: [-0.21, 0.06, -0.008],
        tangential: [0.0011, -0.0007],
    }
}

/// A C… camera whose optical axis is none of its frame's axes.
fn cahvore(linearity: f64, r: [f64; 3], e: [f64; 3]) -> Cahvore {
    let cahv = Cahv {
        c: Vec3::new(0.8, 0.55, -1.9),
        a: Vec3::new(0.350_455_889_176_758_66, 0.100_130_254_050_502_47, 0.931_211_362_669_673_01),
        h: Vec3::new(853.870_901_279_621_83, 36.838_214_771_645_672, 223.705_704_845_371_39),
        v: Vec3::new(168.867_953_463_036_8, 766.885_320_019_841_25, 407.835_239_687_880_96),
    };
    let o =
        Vec3::new(0.351_986_976_722_787_43, 0.096_996_411_199_177_217, 0.930_965_554_911_690_61);
    Cahvore { cahvor: Cahvor { cahv, o, r }, e, linearity }
}

const R: [f64; 3] = [0.0003, 0.0301, -0.011];
const E: [f64; 3] = [0.012, 0.004, -0.0009];

fn points() -> [Vec3; 4] {
    [
        Vec3::new(2.1, 0.9, 1.4),
        Vec3::new(0.2, 1.9, 2.5),
        Vec3::new(3.5, -0.5, 0.9),
        Vec3::new(1.6, 0.75, 0.1),
    ]
}

/// Compares with OpenCV 5.0, `projectPoints` with the same numbers.
#[test]
fn brown_is_that_of_opencv() {
    let lens = Lens::Brown(brown());
    for (p, want) in [
        ([0.3, -0.2, 1.1], [427.553_418_829_290_3, 169.780_184_475_853_36]),
        ([-0.7, 0.45, 1.6], [148.057_064_420_520_33, 349.878_441_179_411_25]),
        ([1.2, 0.9, 2.5], [501.599_077_593_6, 377.734_717_241_6]),
        ([0.01, 0.02, 3.0], [319.666_648_444_697_46, 244.400_020_250_509_98]),
    ] {
        let got = lens.project(&Vec3::from(p)).unwrap();
        assert!((0..2).all(|k| (got[k] - want[k]).abs() < 1e-10), "{p:?}: {got:?} {want:?}");
    }
}

/// The same equations in 40 digits by bisection over the angle. JPL's library cmod, through cycahvore 0.0.1a0, gives the same numbers to 1e-12.
#[test]
fn cahvor_and_cahvore_are_those_of_forty_digits() {
    let near = |lens: Lens, want: [[f64; 2]; 4]| {
        for (p, want) in points().iter().zip(want) {
            let got = lens.project(p).unwrap();
            assert!((0..2).all(|k| (got[k] - want[k]).abs() < 1e-9), "{p}: {got:?} {want:?}");
        }
    };
    near(
        Lens::Cahvor(cahvore(1.0, R, E).cahvor),
        [
            [522.265_816_146_121_6, 514.585_608_335_020_2],
            [126.205_873_648_900_2, 679.850_403_593_176_1],
            [842.136_576_346_677_2, 227.097_521_126_081_1],
            [526.113_334_035_861_3, 510.510_912_859_052],
        ],
    );
    near(
        Lens::Cahvore(cahvore(1.0, R, E)),
        [
            [522.265_817_199_149_3, 514.585_608_449_907_5],
            [126.145_525_803_193_7, 679.876_397_400_477_7],
            [842.200_630_186_857_5, 227.041_885_361_233_2],
            [526.113_338_856_377_7, 510.510_911_806_228_3],
        ],
    );
    near(
        Lens::Cahvore(cahvore(0.0, R, E)),
        [
            [522.265_191_795_676_6, 514.585_540_217_202_1],
            [162.763_242_689_236_3, 664.103_939_155_800_1],
            [808.948_104_892_737_5, 255.924_301_663_750_3],
            [526.111_601_377_467_1, 510.511_291_279_883_2],
        ],
    );
    near(
        Lens::Cahvore(cahvore(-0.3, R, E)),
        [
            [522.265_163_654_683, 514.585_537_146_966_3],
            [164.224_862_907_836, 663.474_371_126_226_2],
            [807.631_214_731_168_6, 257.068_123_660_266_3],
            [526.111_523_202_928_3, 510.511_308_353_574_3],
        ],
    );
}

fn lenses() -> Vec<Lens> {
    let mut all = vec![
        Lens::Brown(Brown::ideal(640, 480, 1.0)),
        Lens::Brown(brown()),
        Lens::Cahv(cahvore(1.0, R, E).cahvor.cahv),
        Lens::Cahvor(cahvore(1.0, R, E).cahvor),
    ];
    all.extend([1.0, 0.4, 0.0, -0.3, -1.0].map(|l| Lens::Cahvore(cahvore(l, R, E))));
    all
}

#[test]
fn a_point_on_a_pixels_ray_is_seen_in_that_pixel() {
    for lens in lenses() {
        let mut count = 0;
        for k in 0..400 {
            let pixel = [(k * 37 % 641) as f64 - 0.37, (k * 91 % 479) as f64 + 0.21];
            let Some(ray) = lens.ray(pixel) else { continue };
            assert!((ray.direction.norm() - 1.0).abs() < 1e-14);
            for distance in [0.5, 3.0, 700.0] {
                let at = lens.project(&(ray.origin + ray.direction * distance)).unwrap();
                let off = (at[0] - pixel[0]).hypot(at[1] - pixel[1]);
                assert!(off < 1e-9, "{lens:?} {pixel:?} {distance}: {off}");
            }
            count += 1;
        }
        assert!(count > 300, "{lens:?}: only {count} pixels have rays");
    }
}

#[test]
fn each_model_holds_the_simpler_one() {
    let full = cahvore(1.0, [0.0; 3], [0.0; 3]);
    let pin = Brown { radial: [0.0; 3], tangential: [0.0; 2], ..brown() };
    let aligned = Cahv {
        c: Vec3::zeros(),
        a: Vec3::z(),
        h: Vec3::new(410.0, 0.0, 318.3),
        v: Vec3::new(0.0, 405.0, 241.7),
    };
    for p in points() {
        let all = [Lens::Cahv(full.cahvor.cahv), Lens::Cahvor(full.cahvor), Lens::Cahvore(full)];
        let all = all.map(|l| l.project(&p).unwrap());
        let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!(off(all[0], all[1]) < 1e-10 && off(all[0], all[2]) < 1e-10, "{all:?}");
        let q = Vec3::new(p.x, p.y, p.z + 1.0);
        let (a, b) =
            (Lens::Brown(pin).project(&q).unwrap(), Lens::Cahv(aligned).project(&q).unwrap());
        assert!(off(a, b) < 1e-10);
    }
}

/// An equidistant fisheye maps angles to distances, also beyond 80°.
#[test]
fn a_fisheye_is_linear_in_the_angle() {
    let cahv = Cahv {
        c: Vec3::zeros(),
        a: Vec3::z(),
        h: Vec3::new(300.0, 0.0, 500.0),
        v: Vec3::new(0.0, 300.0, 500.0),
    };
    let lens = Lens::Cahvore(Cahvore {
        cahvor: Cahvor { cahv, o: Vec3::z(), r: [0.0; 3] },
        e: [0.0; 3],
        linearity: 0.0,
    });
    for degrees in [1.0f64, 30.0, 60.0, 85.0, 100.0] {
        let t = degrees.to_radians();
        let at = lens.project(&Vec3::new(4.0 * t.sin(), 0.0, 4.0 * t.cos())).unwrap();
        assert!((at[0] - 500.0 - 300.0 * t).abs() < 1e-9 && (at[1] - 500.0).abs() < 1e-9, "{at:?}");
    }
}

#[test]
fn what_is_behind_or_beyond_the_fold_has_no_pixel() {
    let lens = Lens::Brown(brown());
    assert!(lens.project(&Vec3::new(0.1, 0.1, -1.0)).is_none());
    assert!(lens.project(&Vec3::new(0.1, f64::NAN, 1.0)).is_none());
    // With k₁ < 0, the image folds back at ρ = 1/(3 · 0.3): a point outside would be projected onto a pixel that is
    // already used.
    let folds = Lens::Brown(Brown { radial: [-0.3, 0.0, 0.0], tangential: [0.0; 2], ..brown() });
    assert!(folds.project(&Vec3::new(1.0, 0.0, 1.0)).is_some());
    assert!(folds.project(&Vec3::new(1.1, 0.0, 1.0)).is_none());
    assert!(
        folds.ray([318.3 + 410.0 * 0.71, 241.7]).is_none()
            && folds.ray([318.3 + 410.0 * 0.69, 241.7]).is_some()
    );
    let vor = Lens::Cahvor(cahvore(1.0, [0.0, -0.3, 0.0], E).cahvor);
    let behind = Vec3::new(0.8, 0.55, -1.9) - Vec3::new(0.35, 0.1, 0.93);
    assert!(vor.project(&behind).is_none());
    assert!(Lens::Cahvore(cahvore(0.4, R, E)).project(&behind).is_none());
}

#[test]
fn what_is_no_lens_is_refused_with_the_reason() {
    let refused = |lens: Lens, word: &str| {
        let e = lens.check().unwrap_err().to_string();
        assert!(e.contains(word) && e.contains("help:"), "{e}");
    };
    refused(Lens::Brown(Brown { focal: [0.0, 1.0], ..brown() }), "focal length");
    refused(Lens::Brown(Brown { radial: [f64::NAN, 0.0, 0.0], ..brown() }), "finite");
    let good = cahvore(0.5, R, E);
    let mut flat = good.cahvor.cahv;
    flat.v = flat.h;
    refused(Lens::Cahv(flat), "one plane");
    let mut long = good.cahvor;
    long.o *= 1.1;
    refused(Lens::Cahvor(long), "length");
    refused(Lens::Cahvore(Cahvore { linearity: 2.0, ..good }), "linearity");
    lenses().iter().for_each(|l| l.check().unwrap());
}
