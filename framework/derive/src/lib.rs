//! Derive macros: `#[derive(Ports)]`, `#[derive(State)]`, `#[derive(Params)]`, `#[model]`, `#[service]`,
//! `#[field]`.
//!
//! They turn plain structs into lanes with names, units and documentation, and they read from
//! the *signatures* of a model's functions what depends on what (ARCHITECTURE.md, rule 3).

mod field;
mod lanes;
mod model;
mod params;
mod service;

use proc_macro::TokenStream;
use proc_macro_crate::{FoundCrate, crate_name};
use proc_macro2::{Span, TokenStream as Tokens};
use quote::quote;
use syn::{Attribute, Expr, ExprLit, Ident, ItemImpl, Lit, Meta};

/// Lanes, names, units and bindings of an input or output struct.
///
/// Field attribute: `#[port("N m", default = 0.0, sum, bind = "shaft", frame = "body")]`, or `#[port(group)]` or `#[port(connector)]` for a field
/// that is such a struct itself, or an array of them: its ports are `wheel.rate`, `wheels[2].rate`. `stored`, `gained` and `lost` count a number in the balances of
/// its part: `#[port("W", lost)]`.
#[proc_macro_derive(Ports, attributes(port))]
pub fn ports(input: TokenStream) -> TokenStream {
    finish(lanes::derive(&syn::parse_macro_input!(input as syn::DeriveInput)))
}

/// Lanes, names and units of a continuous or discrete state struct: `#[port("kg", stored)]`.
#[proc_macro_derive(State, attributes(port))]
pub fn state(input: TokenStream) -> TokenStream {
    finish(lanes::derive(&syn::parse_macro_input!(input as syn::DeriveInput)))
}

/// Parameters with units, ranges, defaults and documentation.
///
/// Field attribute: `#[param(unit = "ohm", range = 1e-3.., default = 1.0, service)]`. `slider = "N/m"` is the unit on sliders, and `needs = "brake"`
/// states the parameters without which it has no effect.
#[proc_macro_derive(Params, attributes(param))]
pub fn params(input: TokenStream) -> TokenStream {
    finish(params::derive(&syn::parse_macro_input!(input as syn::DeriveInput)))
}

/// Completes an `impl Model`: missing associated types become `()`, missing trailing arguments
/// are added, and the dependencies are read from what is written.
#[proc_macro_attribute]
pub fn model(attr: TokenStream, item: TokenStream) -> TokenStream {
    let name = syn::parse_macro_input!(attr as syn::LitStr);
    finish(model::expand(&name, syn::parse_macro_input!(item as syn::ItemImpl)))
}

/// Completes an `impl Service`: `#[service("environment.height_field", Terrain)]`.
#[proc_macro_attribute]
pub fn service(attr: TokenStream, item: TokenStream) -> TokenStream {
    let attr = syn::parse_macro_input!(attr as service::Attr);
    finish(service::expand(&attr, syn::parse_macro_input!(item as syn::ItemImpl)))
}

/// Completes an `impl Field`: `#[field("mobility.ruts")]`.
#[proc_macro_attribute]
pub fn field(attr: TokenStream, item: TokenStream) -> TokenStream {
    let name = syn::parse_macro_input!(attr as syn::LitStr);
    finish(field::expand(&name, syn::parse_macro_input!(item as syn::ItemImpl)))
}

/// Makes the type of an `impl` a type of part: `kind` is the constructor of its entry in a catalogue.
fn part_type(item: &ItemImpl, kind: &str) -> Tokens {
    let (rt, ty) = (runtime(), &item.self_ty);
    let (generics, _, bounds) = item.generics.split_for_impl();
    let trait_path = item.trait_.as_ref().map(|(_, path, _)| path);
    let kind = Ident::new(kind, Span::call_site());
    quote! {
        #[automatically_derived]
        impl #generics #rt::PartType for #ty #bounds {
            type Builder = <<Self as #trait_path>::Params as #rt::Params>::Builder;
            fn entry() -> #rt::Entry { #rt::Entry::#kind::<Self>() }
        }
    }
}

fn finish(result: syn::Result<Tokens>) -> TokenStream {
    result.unwrap_or_else(|e| e.to_compile_error()).into()
}

/// Returns the path of the runtime crate in the calling crate.
fn runtime() -> Tokens {
    match crate_name("linkwork-runtime") {
        Ok(FoundCrate::Name(name)) => {
            let name = Ident::new(&name, Span::call_site());
            quote!(::#name)
        }
        Ok(FoundCrate::Itself) => quote!(::linkwork_runtime),
        Err(_) => quote!(::linkwork::runtime),
    }
}

/// The doc comment above an item, lines joined.
fn doc_of(attrs: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for attr in attrs.iter().filter(|a| a.path().is_ident("doc")) {
        if let Meta::NameValue(nv) = &attr.meta
            && let Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) = &nv.value
        {
            lines.push(text.value().trim_start_matches(' ').to_string());
        }
    }
    lines.join("\n").trim().to_string()
}
