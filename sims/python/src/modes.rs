//! `Modes`: mode shapes of flexible bodies.
use crate::array::{Array1, Array2, out1, out2};
use crate::error::refuse;
use crate::mechanism::choice;
use crate::show::number;
use linkwork_multibody::modes::{self, Beam, BeamModes, Ends, GeneratorFault, Plate};
use pyo3::prelude::*;

/// Names of the boundary conditions of a beam.
const ENDS: [(&str, Ends); 5] = [
    ("clamped_free", Ends::ClampedFree),
    ("clamped_clamped", Ends::ClampedClamped),
    ("clamped_pinned", Ends::ClampedPinned),
    ("pinned_pinned", Ends::PinnedPinned),
    ("free_free", Ends::FreeFree),
];

/// Mode shapes of a flexible body, for `Builder.body(modes=...)`.
///
/// A body is a beam along its x axis, or a plate in its x–y plane. Its whole mass is distributed along it.
///
/// Notes
/// -----
/// In q and v, the modal coordinates η of a body and their rates follow those of its hinge; `Mechanism.modes` returns their slices. Shapes are
/// scaled to a largest deflection or rotation of 1, so η is in m (bending, stretch) or rad (twist).
///
/// Examples
/// --------
/// >>> modes = linkwork.Modes.beam(2, young=70e9, shear=26e9, density=2700, area=1e-4, I_y=1e-9, I_z=1e-9, J=2e-9, bending_z=2)
/// >>> modes
/// Modes(2, 0.54 kg)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Modes {
    pub modes: modes::Modes,
}

fn made(modes: Result<modes::Modes, Vec<GeneratorFault>>) -> PyResult<Modes> {
    let modes = modes.map_err(|faults| {
        let all: Vec<String> = faults.iter().map(ToString::to_string).collect();
        refuse(all.join("\n"))
    })?;
    Ok(Modes { modes })
}

#[pymethods]
impl Modes {
    /// Compute the modes of a straight uniform beam from the body's frame to x = `length`.
    ///
    /// Euler–Bernoulli theory, including the rotary inertia of the sections.
    ///
    /// Parameters
    /// ----------
    /// length : float
    ///     Length, m.
    /// young, shear : float
    ///     Young's modulus and shear modulus, Pa.
    /// density : float
    ///     kg/m³.
    /// area : float
    ///     Area of the section, m².
    /// I_y, I_z : float
    ///     Second moments of area, m⁴: ∫ z² dA for bending along z, and ∫ y² dA for bending along y.
    /// J : float
    ///     Torsion constant, m⁴.
    /// ends : {"clamped_free", "clamped_clamped", "clamped_pinned", "pinned_pinned", "free_free"}
    ///     Boundary conditions at x = 0, where the body's frame is, and at x = `length`.
    /// damping_ratio : float
    ///     Fraction of critical damping of each mode (default: 0).
    /// bending_y, bending_z, twist, stretch : int
    ///     Number of modes of each kind, lowest frequency first (default: 0). η has them in this order.
    ///
    /// Returns
    /// -------
    /// Modes
    ///     The modes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no beam can have these dimensions, or more modes are requested than the method computes accurately.
    ///
    /// Examples
    /// --------
    /// >>> arm = linkwork.Modes.beam(1, young=70e9, shear=26e9, density=2700, area=1e-4, I_y=1e-9, I_z=1e-9, J=2e-9, bending_y=1, twist=1)
    /// >>> arm.count
    /// 2
    #[staticmethod]
    #[pyo3(signature = (length, *, young, shear, density, area, I_y, I_z, J, ends="clamped_free", damping_ratio=0.0, bending_y=0, bending_z=0, twist=0, stretch=0))]
    #[allow(clippy::too_many_arguments)]
    fn beam(
        length: f64,
        young: f64,
        shear: f64,
        density: f64,
        area: f64,
        I_y: f64,
        I_z: f64,
        J: f64,
        ends: &str,
        damping_ratio: f64,
        bending_y: usize,
        bending_z: usize,
        twist: usize,
        stretch: usize,
    ) -> PyResult<Self> {
        let ends = choice("ends", ends, &ENDS)?;
        let beam = Beam { length, young, shear, density, area, I_y, I_z, J, ends, damping_ratio };
        made(beam.modes(BeamModes { bending_y, bending_z, twist, stretch }))
    }

    /// Compute the modes of a thin rectangular plate in the body's x–y plane.
    ///
    /// The plate is clamped along x = 0, where the body's frame is, and free at x = `length` and y = ±`width`/2.
    ///
    /// Parameters
    /// ----------
    /// length, width, thickness : float
    ///     Dimensions, m.
    /// young : float
    ///     Young's modulus, Pa.
    /// poisson : float
    ///     Poisson's ratio.
    /// density : float
    ///     kg/m³.
    /// count : int
    ///     Number of modes, lowest frequency first.
    /// damping_ratio : float
    ///     Fraction of critical damping of each mode (default: 0).
    /// attach : sequence of (x, y), optional
    ///     Points, shape (n, 2), m, at which other bodies and nodes are attached, in addition to the corners.
    ///
    /// Returns
    /// -------
    /// Modes
    ///     The modes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no plate can have these dimensions, a point is outside the plate, or more modes are requested than the method computes accurately.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Modes.plate(2, 1, 0.01, young=70e9, poisson=0.3, density=2700, count=3)
    /// Modes(3, 54 kg)
    #[staticmethod]
    #[pyo3(signature = (length, width, thickness, *, young, poisson, density, count, damping_ratio=0.0, attach=None))]
    #[allow(clippy::too_many_arguments)]
    fn plate(
        length: f64,
        width: f64,
        thickness: f64,
        young: f64,
        poisson: f64,
        density: f64,
        count: usize,
        damping_ratio: f64,
        attach: Option<Vec<[f64; 2]>>,
    ) -> PyResult<Self> {
        // Every body has a node at its origin, so the origin must be an attachment point.
        let mut attach = attach.unwrap_or_default();
        attach.push([0.0, 0.0]);
        let plate =
            Plate { length, width, thickness, young, poisson, density, damping_ratio, attach };
        made(plate.modes(count))
    }

    /// Number of modes.
    ///
    /// Examples
    /// --------
    /// >>> modes.count
    /// 2
    #[getter]
    fn count(&self) -> usize {
        self.modes.count()
    }
    /// Mass of the flexible body, kg. It is added to the mass of `Builder.body`.
    ///
    /// Examples
    /// --------
    /// >>> round(modes.mass, 9)
    /// 0.54
    #[getter]
    fn mass(&self) -> f64 {
        self.modes.mass()
    }
    /// Modal stiffness matrix K (n, n), N/m (bending, stretch) or N m/rad (twist). The elastic force on η is −K η.
    ///
    /// Examples
    /// --------
    /// >>> bool((np.diag(modes.stiffness) > 0).all())
    /// True
    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.modes.stiffness_matrix(), self.modes.count(), self.modes.count())
    }
    /// Modal damping matrix C (n, n), N s/m or N m s/rad.
    ///
    /// Examples
    /// --------
    /// >>> modes.damping.tolist()
    /// [[0.0, 0.0], [0.0, 0.0]]
    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.modes.damping_matrix(), self.modes.count(), self.modes.count())
    }
    /// Modal mass matrix M (n, n) with the body's frame fixed, kg or kg m².
    ///
    /// Examples
    /// --------
    /// >>> modes.mass_matrix.shape
    /// (2, 2)
    #[getter]
    fn mass_matrix<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.modes.mass_matrix(), self.modes.count(), self.modes.count())
    }
    /// Natural frequencies (n,), Hz, with the body's frame fixed. Coupling between modes is neglected.
    ///
    /// Examples
    /// --------
    /// >>> modes.frequencies.round(2).tolist()
    /// [2.25, 14.12]
    #[getter]
    fn frequencies<'py>(&self, py: Python<'py>) -> Array1<'py> {
        let (n, K, M) =
            (self.modes.count(), self.modes.stiffness_matrix(), self.modes.mass_matrix());
        let of = |i: usize| (K[i * n + i] / M[i * n + i]).sqrt() / std::f64::consts::TAU;
        out1(py, (0..n).map(of).collect())
    }
    fn __repr__(&self) -> String {
        format!("Modes({}, {} kg)", self.modes.count(), number(self.modes.mass()))
    }
}
