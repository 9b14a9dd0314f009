//! Variants: an assembly file that is based on another one, with other defaults of its parameters.
use crate::form::assembly::AssemblyForm;
use crate::schema::describe::Schema;
use crate::schema::kind::{Kind, raw, table_of, text};
use crate::schema::record::{Presence, of, record};
use crate::scope::parameters::ParamForm;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Located, remedy};

record! {
    /// The fields of a variant.
    pub(crate) struct VariantForm: "variant" {
        /// The base assembly file: relative to this one, then in the search folders, then embedded.
        like: Text = text().need("write `like: \"rover.ron\"`"),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Name of the assembly, if it is used alone.
        name: Option<Text> = text().maybe(),
        /// New defaults of its parameters, by name.
        params: Option<Located> = raw(|| table_of(of::<ParamForm>()).describe()).maybe(),
        /// Deep parameters by path.
        overrides: Option<Located> = raw(|| Schema::Table(Box::new(Schema::Any(Vec::new())))).maybe(),
    }
}

/// Returns `base` with the defaults and the overrides of `own`.
pub(crate) fn variant(
    cx: &mut Cx,
    own: AssemblyForm,
    base: &AssemblyForm,
    base_key: &str,
) -> AssemblyForm {
    let mut out = base.clone();
    let known: Vec<&str> = base.params.keys().map(String::as_str).collect();
    for (key, mut decl) in own.params {
        let Some(of_base) = base.params.get(&key) else {
            let message = format!("`{base_key}` has no parameter `{key}`");
            cx.fault(decl.origin, message, remedy(&key, "parameters", &known));
            continue;
        };
        if decl.unit.is_some() || decl.range_written.is_some() {
            let message = format!("parameter `{key}`: a variant can only change the default");
            let help = format!("remove `unit` and `range`: `{base_key}` defines them");
            cx.fault(decl.origin, message, help);
        }
        decl.unit.clone_from(&of_base.unit);
        decl.range.clone_from(&of_base.range);
        decl.range_written.clone_from(&of_base.range_written);
        decl.default = decl.default.or_else(|| of_base.default.clone());
        if decl.doc.is_empty() {
            decl.doc.clone_from(&of_base.doc);
        }
        out.params.insert(key, decl);
    }
    out.overrides.extend(own.overrides);
    out.broken.extend(own.broken);
    out.name = own.name;
    if !own.doc.is_empty() {
        out.doc = own.doc;
    }
    out
}
