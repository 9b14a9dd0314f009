//! `#[model("actuators.dc_motor")]`: completes an `impl Model` and reads its dependencies.
use crate::{doc_of, part_type, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::{FnArg, ImplItem, ImplItemFn, ItemImpl, LitStr, Pat, parse_quote};

/// Function, full number of arguments after `&self`, and the types that may be left out at the end.
const FUNCTIONS: [(&str, &[&str]); 9] = [
    ("moore", &["Clock", "X", "D", "Store"]),
    ("direct", &["Clock", "X", "D", "Ud", "Store"]),
    ("deriv", &["Clock", "X", "D", "U", "Ud", "Store", "Yd"]),
    ("update", &["Clock", "X", "D", "U", "Ud", "Store!"]),
    ("guards", &["Clock", "X", "D", "U", "Ud", "Store"]),
    ("fired", &["Clock", "Fired", "X", "D", "U", "Ud", "Store!"]),
    ("mode", &["Clock", "X", "D", "Ud", "Store"]),
    ("remarks", &["Clock", "X", "D", "U", "Ud", "Store"]),
    ("tells", &["Clock", "Fired", "X", "D", "U", "Ud", "Store"]),
];

pub fn expand(name: &LitStr, mut item: ItemImpl) -> syn::Result<Tokens> {
    let rt = runtime();
    let doc = doc_of(&item.attrs);
    if doc.is_empty() {
        return Err(syn::Error::new_spanned(
            &item.self_ty,
            "a model needs a doc comment above #[model]: `linkwork describe` shows it",
        ));
    }
    let written: Vec<String> = item
        .items
        .iter()
        .filter_map(|i| match i {
            ImplItem::Type(t) => Some(t.ident.to_string()),
            ImplItem::Fn(f) => Some(f.sig.ident.to_string()),
            _ => None,
        })
        .collect();
    let has = |n: &str| written.iter().any(|w| w == n);
    let needs: [(&str, &[&str]); 6] = [
        ("Ym", &["moore"]),
        ("Yd", &["direct"]),
        ("X", &["deriv"]),
        ("D", &["update", "fired"]),
        ("G", &["guards"]),
        ("G", &["fired"]),
    ];
    for (ty, functions) in needs {
        if has(ty) && !functions.iter().any(|f| has(f)) {
            return Err(syn::Error::new_spanned(
                &item.self_ty,
                format!(
                    "`type {ty}` is declared but there is no `fn {}`",
                    functions.join("` or `fn ")
                ),
            ));
        }
    }
    for function in ["guards", "fired", "tells", "mode"] {
        if has(function) && !has("G") {
            return Err(syn::Error::new_spanned(
                &item.self_ty,
                format!("`fn {function}` needs `type G`: a struct of the guards, deriving `Ports`"),
            ));
        }
    }
    let mut timed = [false; FUNCTIONS.len()];
    let mut outputs = false;
    for it in &mut item.items {
        let ImplItem::Fn(f) = it else { continue };
        let Some(k) = FUNCTIONS.iter().position(|(n, _)| f.sig.ident == n) else { continue };
        let reads_outputs = FUNCTIONS[k].0 == "deriv" && f.sig.inputs.len() == 8;
        if reads_outputs && !written.iter().any(|w| w == "direct") {
            return Err(syn::Error::new_spanned(
                &f.sig,
                "`deriv` reads the direct outputs (its last argument) but there is no `fn direct`",
            ));
        }
        outputs |= reads_outputs;
        timed[k] = complete(f, FUNCTIONS[k].1, &rt)?;
    }
    for ty in ["Params", "U", "Ud", "Ym", "Yd", "X", "D", "Store", "G"] {
        if !has(ty) {
            let ident = format_ident!("{ty}");
            item.items.push(parse_quote!(type #ident = ();));
        }
    }
    if !has("build") {
        if has("Params") {
            item.items.push(parse_quote! {
                fn build(p: Self::Params) -> Result<Self, #rt::BuildError> { Ok(Self { p }) }
            });
        } else {
            item.items.push(parse_quote! {
                fn build(_: Self::Params) -> Result<Self, #rt::BuildError> { Ok(Self {}) }
            });
        }
    }
    let [m, d, v, u, g, o] = ["moore", "direct", "deriv", "update", "guards", "overlay"].map(has);
    let (tm, td) = (timed[0], timed[1]);
    item.items.push(parse_quote!(const NAME: &'static str = #name;));
    item.items.push(parse_quote!(const DOC: &'static str = #doc;));
    item.items.push(parse_quote! {
        const FUNCTIONS: #rt::Functions = #rt::Functions {
            moore: #m, direct: #d, deriv: #v, update: #u, moore_timed: #tm, direct_timed: #td,
            deriv_outputs: #outputs, direct_after_moore: false, guards: #g, modes: false, averages: false, steps: false, overlay: #o,
        };
    });
    let part_type = part_type(&item, "model");
    Ok(quote!(#item #part_type))
}

/// Adds the trailing arguments that were left out; tells whether the clock is used.
fn complete(f: &mut ImplItemFn, full: &[&str], rt: &Tokens) -> syn::Result<bool> {
    let given = f.sig.inputs.len().saturating_sub(1);
    if !matches!(f.sig.inputs.first(), Some(FnArg::Receiver(_))) || given == 0 || given > full.len()
    {
        let list = full
            .iter()
            .map(|t| match *t {
                "Fired" => (*t).to_string(),
                _ => format!("&{t}"),
            })
            .collect::<Vec<_>>()
            .join(", ");
        return Err(syn::Error::new_spanned(
            &f.sig,
            format!("`{}` takes (&self, {list}), trailing ones optional", f.sig.ident),
        ));
    }
    for (k, ty) in full.iter().enumerate().skip(given) {
        let arg = format_ident!("_arg{k}");
        f.sig.inputs.push(match *ty {
            "Clock" => parse_quote!(#arg: &#rt::Clock),
            "Fired" => parse_quote!(#arg: #rt::Fired<'_>),
            "Store!" => parse_quote!(#arg: &mut Self::Store),
            other => {
                let t = format_ident!("{other}");
                parse_quote!(#arg: &Self::#t)
            }
        });
    }
    let clock = match f.sig.inputs.iter().nth(1) {
        Some(FnArg::Typed(t)) => match &*t.pat {
            Pat::Wild(_) => false,
            Pat::Ident(i) => !i.ident.to_string().starts_with('_'),
            _ => true,
        },
        _ => true,
    };
    Ok(clock)
}
