//! Binary kernels of orientation (PCK), compared with CSPICE.
use linkwork_world::planet::rotation::PckKernel;
use linkwork_world::spatial::Vec3;

/// Rotations from CSPICE N0067 (`data/pck/make.py`): number of the axes, TDB second, rows of the rotation from the body to J2000, and the angular
/// velocity (rad/s, J2000).
const ROTATIONS: [(i32, f64, [f64; 9], [f64; 3]); 8] = [
    (
        31001,
        604800000.0,
        [
            -0.8330880431916895,
            -0.29311462079424716,
            -0.4690928813867105,
            -0.01716372374568853,
            -0.8339471561756677,
            0.551577326667529,
            -0.5528740533595545,
            0.46756385636954556,
            0.6897204660865266,
        ],
        [-1.253825987392083e-06, 1.4639465757680053e-06, 1.844356766634695e-06],
    ),
    (
        31001,
        605085120.0,
        [
            -0.8064858437656567,
            0.35974487807237804,
            -0.46921658805533145,
            -0.5857988535057878,
            -0.593723186477552,
            0.5516633765896073,
            -0.08012669366011158,
            0.7197752430721913,
            0.6895674821389612,
        ],
        [-1.264117568459684e-06, 1.4659396366962717e-06, 1.8533691650775151e-06],
    ),
    (
        31001,
        605145600.0,
        [
            -0.7389582955750021,
            0.4839183815686818,
            -0.4687895448715079,
            -0.6727938710534102,
            -0.4929212509920918,
            0.5517037677897068,
            0.03590326550406169,
            0.7230848085116566,
            0.6898255686953085,
        ],
        [-1.2707504710499214e-06, 1.4638754851237075e-06, 1.8671291172365237e-06],
    ),
    (
        31001,
        605810880.0,
        [
            0.6202213790210988,
            0.6278095639144443,
            -0.4702984078887808,
            -0.3482278651872135,
            0.7575896031683673,
            0.5520827357184354,
            0.7028960057592607,
            -0.17864250510097324,
            0.688494052595174,
        ],
        [-1.258947962504006e-06, 1.4695548702405172e-06, 1.8365728602376143e-06],
    ),
    (
        31001,
        605931840.0,
        [
            0.7869314333795971,
            0.39772454672027324,
            -0.4717564033431721,
            -0.0879811760914968,
            0.8290590584033881,
            0.552195970949485,
            0.6107358117981044,
            -0.3930346837308899,
            0.6874049065666246,
        ],
        [-1.243068799836892e-06, 1.4677678184510104e-06, 1.8128001651595343e-06],
    ),
    (
        31001,
        606355200.0,
        [
            0.6986646022085651,
            -0.5383270245168468,
            -0.47124493450390076,
            0.7096143650545524,
            0.43745919800572874,
            0.5523376711653922,
            -0.09118786393469154,
            -0.7203009542927337,
            0.6876418462513793,
        ],
        [-1.2295628250918353e-06, 1.4671778338820756e-06, 1.8000715215390095e-06],
    ),
    (
        3000,
        604821600.0,
        [
            -0.7448570117391555,
            0.5524122462675761,
            0.37420414513554834,
            -0.6638635450475512,
            -0.5573624827766905,
            -0.49863038049230557,
            -0.06688217714693243,
            -0.6198288255370303,
            0.7818817055114361,
        ],
        [2.7287235642436883e-05, -3.6263527168213855e-05, 5.6941718158413254e-05],
    ),
    (
        3000,
        604964160.0,
        [
            -0.03675009225071507,
            -0.9268307385195493,
            0.3736766153438971,
            0.8348279726326246,
            -0.23400538119714154,
            -0.49830085057210416,
            0.5492828841586692,
            0.29364308898063196,
            0.782343945758032,
        ],
        [2.7249677017797377e-05, -3.646116457233515e-05, 5.7142338184536584e-05],
    ),
];

#[test]
fn binary_kernels_of_orientation_are_read_as_by_cspice() {
    let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/pck/rotations.bpc"))
        .unwrap();
    let pck = PckKernel::parse("rotations.bpc", &bytes).unwrap();
    for (body, et, rows, omega) in ROTATIONS {
        // The simulation starts at the date itself, or at the beginning of the kernel; both must
        // give the same result.
        for days in [et / 86_400.0, 7000.0] {
            let rotation = pck.rotation(body, (days.floor(), days.fract())).unwrap();
            let spin = rotation.at(et - days.floor() * 86_400.0 - days.fract() * 86_400.0);
            let R = spin.R_IP.to_rotation_matrix().into_inner();
            for (k, want) in rows.iter().enumerate() {
                let own = R[(k / 3, k % 3)];
                // The angle w of body 3000 is 44 000 rad, with a round-off of 7e-12. Measured: 1.2e-12.
                assert!((own - want).abs() < 1e-11, "{body} {et} {k}: {own} {want}");
            }
            let error = (spin.omega_I - Vec3::from(omega)).norm() / Vec3::from(omega).norm();
            assert!(error < 1e-11, "{body} {et}: {error:e}");
        }
    }
    // Body 31001 has segments from day 0 to 12 and from day 10 to 18.
    let rotation = pck.rotation(31001, (7001.0, 0.0)).unwrap();
    assert_eq!(rotation.range(), [-86_400.0, 17.0 * 86_400.0]);
    assert!(rotation.at(-86_401.0).omega_I.x.is_nan());
    assert!(rotation.at(17.1 * 86_400.0).R_IP.w.is_nan());
    for (body, days, part) in [
        (31001, 6999.0, "has the rotation of body 31001 from 2019-03-02"),
        (7, 7000.0, "has no rotation of body 7; it has 3000, 31001"),
    ] {
        let error = pck.rotation(body, (days, 0.0)).unwrap_err().to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
}

#[test]
fn damaged_and_other_binary_kernels_are_refused() {
    let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/pck/rotations.bpc"))
        .unwrap();
    let with = |at: usize, new: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        PckKernel::parse("r.bpc", &bytes).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(with(0, b"DAF/SPK ").contains("it does not begin with `DAF/PCK`"));
    assert!(with(12, &6_i32.to_le_bytes()).contains("ND, NI are not 2, 5"));
    assert!(with(88, b"VAX-GFLT").contains("number format"));
    let cut = PckKernel::parse("r.bpc", &bytes[..bytes.len() - 1024]).unwrap_err().to_string();
    assert!(cut.contains("it ends before byte"), "{cut}");
    // The three summaries follow the head of their record. The type is the third integer of a
    // summary.
    let first = usize::try_from(i32::from_le_bytes(bytes[76..80].try_into().unwrap())).unwrap();
    let kind = |k: usize| (first - 1) * 1024 + 24 + 40 * k + 24;
    let mut other = bytes.clone();
    for k in 0..3 {
        other[kind(k)..kind(k) + 4].copy_from_slice(&3_i32.to_le_bytes());
    }
    let error = PckKernel::parse("r.bpc", &other).unwrap_err().to_string();
    assert!(error.contains("body 31001 with type 3 in axes 1"), "{error}");
}
