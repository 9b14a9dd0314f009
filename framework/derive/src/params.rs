//! `#[derive(Params)]`: parameters read from a located value, with units, ranges and defaults.
use crate::{doc_of, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{Data, DataEnum, DeriveInput, Expr, Fields, Ident, LitStr, Token, parse::ParseStream};

#[derive(Default)]
struct ParamAttr {
    unit: Option<LitStr>,
    default: Option<Expr>,
    range: Option<Expr>,
    service: bool,
}

fn parse(out: &mut ParamAttr, input: ParseStream) -> syn::Result<()> {
    while !input.is_empty() {
        let key: Ident = input.parse()?;
        let name = key.to_string();
        if name == "service" {
            out.service = true;
        } else {
            input.parse::<Token![=]>()?;
            match name.as_str() {
                "unit" => out.unit = Some(input.parse()?),
                "default" => out.default = Some(input.parse()?),
                "range" => out.range = Some(input.parse()?),
                _ => {
                    return Err(syn::Error::new(
                        key.span(),
                        "unknown param attribute; known: unit, default, range, service",
                    ));
                }
            }
        }
        if !input.is_empty() {
            input.parse::<Token![,]>()?;
        }
    }
    Ok(())
}

pub fn derive(input: &DeriveInput) -> syn::Result<Tokens> {
    let name = &input.ident;
    match &input.data {
        Data::Enum(data) => derive_enum(name, data),
        Data::Struct(data) => derive_struct(name, &data.fields),
        Data::Union(_) => Err(syn::Error::new_spanned(name, "Params is for structs and enums")),
    }
}

fn derive_struct(name: &Ident, fields: &Fields) -> syn::Result<Tokens> {
    let rt = runtime();
    let empty = syn::punctuated::Punctuated::new();
    let named = match fields {
        Fields::Named(f) => &f.named,
        Fields::Unit => &empty,
        Fields::Unnamed(_) => {
            return Err(syn::Error::new_spanned(name, "Params needs named fields"));
        }
    };
    let (mut specs, mut reads, mut idents, mut shows) = (vec![], vec![], vec![], vec![]);
    for (k, field) in named.iter().enumerate() {
        let mut attr = ParamAttr::default();
        for a in field.attrs.iter().filter(|a| a.path().is_ident("param")) {
            a.parse_args_with(|input: ParseStream| parse(&mut attr, input))?;
        }
        let (ident, ty) = (field.ident.as_ref().expect("named"), &field.ty);
        let doc = doc_of(&field.attrs);
        if doc.is_empty() {
            return Err(syn::Error::new_spanned(
                ident,
                "a parameter needs a doc comment: it is shown to users",
            ));
        }
        let text = ident.to_string();
        let unit = match &attr.unit {
            Some(u) => quote!(Some(#u)),
            None => quote!(None),
        };
        let range = match &attr.range {
            Some(r) => quote!(Some(#rt::Range::of(#r))),
            None => quote!(None),
        };
        let (default_text, default_value) = match &attr.default {
            Some(e) => (
                quote!(Some({ let v: #ty = #e; #rt::Param::show(&v) })),
                quote!(Some(|| -> #ty { #e })),
            ),
            None => (quote!(None), quote!(None::<fn() -> #ty>)),
        };
        let service = attr.service;
        specs.push(quote! {
            #rt::ParamSpec {
                name: #text, unit: #unit, doc: #doc, range: #range, default: #default_text,
                kind: <#ty as #rt::Param>::kind(), fields: <#ty as #rt::Param>::fields(),
                service: #service,
            }
        });
        reads.push(quote! {
            let #ident = cx.field::<#ty>(map, &specs[#k], #default_value);
        });
        shows.push(quote!((#text.to_string(), #rt::Param::show(&self.#ident).into())));
        idents.push(ident);
    }
    Ok(quote! {
        #[automatically_derived]
        impl #rt::Params for #name {
            fn specs() -> Vec<#rt::ParamSpec> { vec![#(#specs),*] }
            #[allow(unused_variables)]
            fn read_map(map: &#rt::Located, cx: &mut #rt::ReadCx<'_>) -> Option<Self> {
                let specs = <Self as #rt::Params>::specs();
                let known = cx.only_known(map, &specs);
                #(#reads)*
                if !known { return None; }
                Some(Self { #(#idents: #idents?),* })
            }
            fn show_map(&self) -> #rt::Value {
                #rt::Value::Map(vec![#(#shows),*])
            }
        }
        #[automatically_derived]
        impl #rt::Param for #name {
            fn kind() -> String { "struct".to_string() }
            fn fields() -> Vec<#rt::ParamSpec> { <Self as #rt::Params>::specs() }
            fn read(v: &#rt::Located, _: &#rt::ParamSpec, cx: &mut #rt::ReadCx<'_>) -> Option<Self> {
                <Self as #rt::Params>::read_map(v, cx)
            }
            fn show(&self) -> #rt::Value { <Self as #rt::Params>::show_map(self) }
        }
    })
}

fn derive_enum(name: &Ident, data: &DataEnum) -> syn::Result<Tokens> {
    let rt = runtime();
    let mut idents = vec![];
    for v in &data.variants {
        if !matches!(v.fields, Fields::Unit) {
            return Err(syn::Error::new_spanned(v, "a parameter enum has variants without fields"));
        }
        idents.push(&v.ident);
    }
    let texts: Vec<String> = idents.iter().map(|i| snake(&i.to_string())).collect();
    Ok(quote! {
        #[automatically_derived]
        impl #rt::Param for #name {
            fn kind() -> String { [#(#texts),*].join(" | ") }
            fn read(v: &#rt::Located, spec: &#rt::ParamSpec, cx: &mut #rt::ReadCx<'_>) -> Option<Self> {
                match cx.choice(v, spec, &[#(#texts),*])?.as_str() {
                    #(#texts => Some(Self::#idents),)*
                    _ => None,
                }
            }
            fn show(&self) -> #rt::Value {
                match self { #(Self::#idents => #rt::Value::Text(#texts.to_string())),* }
            }
        }
    })
}

/// `WongReece` → `wong_reece`: how a variant is written in RON.
fn snake(name: &str) -> String {
    let mut out = String::new();
    for (k, c) in name.chars().enumerate() {
        if c.is_uppercase() && k > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}
