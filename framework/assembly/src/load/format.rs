//! The file format as a JSON Schema.
use crate::form::assembly::AssemblyForm;
use crate::form::settings;
use crate::machine::sidecar;
use crate::schema::describe::{Schema, document};
use crate::schema::record::Record;

/// The JSON Schema (draft 2020-12) of the files that this crate reads: `Simulation(..)`, `Assembly(..)`, `SideCar(..)`,
/// as serde would write their RON in JSON: `(a: 1)` is an object, `Name` is `"Name"`, `Name(x)` is `{ "Name": x }`.
/// Numbers have their unit in the description; what parameters a model takes, the catalogue says.
#[must_use]
pub fn schema() -> serde_json::Value {
    let simulation = Schema::Record("simulation", settings::schema_fields);
    let files = vec![
        Schema::Variant("Simulation", Box::new(simulation)),
        Schema::Variant("Assembly", Box::new(AssemblyForm::describe())),
        sidecar::schema(),
    ];
    document("Linkwork simulation, assembly or side-car", &Schema::Any(files))
}
