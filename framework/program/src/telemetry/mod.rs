//! Telemetry: a table of external flight data, and the correspondence of its columns to a simulation.
//!
//! ```ron
//! Telemetry(
//!     doc: "Where it comes from.",
//!     simulation: "sim.ron",                       // beside this file: whose bodies, planet and curves are shown
//!     table: "flown.csv",                          // CSV or Parquet, the first line has the titles
//!     time: (column: ["time", "s"], zero: "12 s"), // this time of the table is the beginning of the simulation
//!     planet: (radius: 6378137, flattening: 0.0033528, rate: 7.292115e-5, angle: 0),
//!     bodies: {
//!         "capsule": (                             // a body of the simulation
//!             position: (latitude: ["lat", "deg"], longitude: ["lon", "deg"], height: ["alt", "ft"]),
//!             attitude: (axes: "north_east_down", yaw: ["psi", "deg"], pitch: ["theta", "deg"], roll: ["phi", "deg"]),
//!         ),
//!     },
//!     curves: { "Dynamic pressure": (column: ["qbar", "psf"], variable: "Aero.pressure") },
//! )
//! ```
//! A column is `["title", "unit"]`, or only its title; its unit is then the one in brackets at the end of the title (`speed [km/s]`, as in tables of
//! Linkwork), or SI without brackets. Positions are given by `x`, `y`, `z` along `axes` or by latitude, longitude and height; attitudes by `w`, `x`,
//! `y`, `z` or by `yaw`, `pitch`, `roll` (3-2-1). Axes are `world` (W of the simulation), `planet` (planet-fixed, origin at its centre), `inertial`
//! (origin at its centre; at time 0 the planet-fixed axes are rotated relative to them by `angle`), and for attitudes also `north_east_down` and
//! `east_north_up` at the position. An empty cell omits that row of that body or curve.
//!
//! ```text
//! X_WP = X_PW⁻¹ of the site of W, or R_z(angle + rate t) where W is inertial      P: axes fixed to the planet
//! R_WB = R_WA R_AT R_BT⁻¹     p_B = p − R_WB point      A: axes of the table, T: its body axes, `turned` in B
//! ```
mod compare;
mod form;
mod frames;
mod show;
mod track;

pub use form::Telemetry;
pub use show::{Beside, FLOWN, alone, beside};
