//! `#[derive(Params)]`: parameters read from a located value, with units, ranges and defaults.
use crate::{doc_of, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{
    Data, DataEnum, DeriveInput, Expr, Fields, GenericArgument, Ident, LitStr, PathArguments,
    Token, Type, parse::ParseStream,
};

#[derive(Default)]
struct ParamAttr {
    unit: Option<LitStr>,
    default: Option<Expr>,
    range: Option<Expr>,
    service: bool,
    slider: Option<LitStr>,
    needs: Option<LitStr>,
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
                "slider" => out.slider = Some(input.parse()?),
                "needs" => out.needs = Some(input.parse()?),
                _ => {
                    return Err(syn::Error::new(
                        key.span(),
                        "unknown param attribute; known: unit, default, range, service, slider, needs",
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
        Data::Struct(data) => derive_struct(input, &data.fields),
        Data::Union(_) => Err(syn::Error::new_spanned(name, "Params is for structs and enums")),
    }
}

fn derive_struct(input: &DeriveInput, fields: &Fields) -> syn::Result<Tokens> {
    let (rt, name) = (runtime(), &input.ident);
    let empty = syn::punctuated::Punctuated::new();
    let named = match fields {
        Fields::Named(f) => &f.named,
        Fields::Unit => &empty,
        Fields::Unnamed(_) => {
            return Err(syn::Error::new_spanned(name, "Params needs named fields"));
        }
    };
    let (mut specs, mut reads, mut idents, mut shows) = (vec![], vec![], vec![], vec![]);
    let mut setters = vec![];
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
        let text_of = |text: &Option<LitStr>| match text {
            Some(text) => quote!(Some(#text)),
            None => quote!(None),
        };
        let (slider, needs) = (text_of(&attr.slider), text_of(&attr.needs));
        specs.push(quote! {
            #rt::ParamSpec {
                name: #text, unit: #unit, doc: #doc, range: #range, default: #default_text,
                kind: <#ty as #rt::Param>::kind(), fields: <#ty as #rt::Param>::fields(),
                service: #service, slider: #slider, needs: #needs,
            }
        });
        reads.push(quote! {
            let #ident = cx.field::<#ty>(map, &specs[#k], #default_value);
        });
        shows.push(quote!((#text.to_string(), #rt::Param::show(&self.#ident).into())));
        idents.push(ident);
        setters.push(setter(ident, &text, ty, &doc));
    }
    let builder = quote::format_ident!("{name}Builder");
    let vis = &input.vis;
    let about =
        format!("Sets parameters of [`{name}`]. Parameters that are not set have their defaults.");
    Ok(quote! {
        #[doc = #about]
        #[derive(Clone, Debug, Default)]
        #vis struct #builder(Vec<(String, #rt::Located)>);
        #[automatically_derived]
        #[allow(dead_code)]
        impl #builder { #(#setters)* }
        #[automatically_derived]
        impl #rt::ParamsBuilder for #builder {
            fn entries(&mut self) -> &mut Vec<(String, #rt::Located)> { &mut self.0 }
        }
        #[automatically_derived]
        impl From<#name> for #builder {
            #[track_caller]
            fn from(all: #name) -> Self {
                let #rt::Value::Map(mut entries) = <#name as #rt::Params>::show_map(&all) else {
                    return Self::default();
                };
                let origin = #rt::Origin::caller();
                entries.iter_mut().for_each(|(_, v)| v.place(origin));
                Self(entries)
            }
        }
        #[automatically_derived]
        impl #rt::Params for #name {
            type Builder = #builder;
            fn specs() -> Vec<#rt::ParamSpec> { vec![#(#specs),*] }
            #[allow(unused_variables)]
            fn read_map(map: &#rt::Located, cx: &mut #rt::ReadCx<'_>) -> Option<Self> {
                let specs = <Self as #rt::Params>::specs();
                let known = cx.only_known(map, &specs);
                cx.settings_of(map, &specs);
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

/// The setter of one field in the builder.
fn setter(ident: &Ident, text: &str, ty: &Type, doc: &str) -> Tokens {
    let rt = runtime();
    let ty = inside("Option", ty).unwrap_or(ty);
    let (argument, value) = if inside("Handle", ty).is_some() {
        // A service is named by the path of its part.
        (quote!(&str), quote!(value))
    } else if is_exact(ty) {
        (quote!(#ty), quote!(#rt::Param::show(&value)))
    } else {
        (quote!(impl Into<#ty>), quote!(#rt::Param::show(&<_ as Into<#ty>>::into(value))))
    };
    quote! {
        #[doc = #doc]
        #[must_use]
        #[track_caller]
        #[inline]
        pub fn #ident(self, value: #argument) -> Self {
            #rt::ParamsBuilder::set(self, #text, #value)
        }
    }
}

/// The argument of a generic type of this name: `T` of `Option<T>`.
fn inside<'t>(name: &str, ty: &'t Type) -> Option<&'t Type> {
    let Type::Path(path) = ty else { return None };
    let last = path.path.segments.last().filter(|s| s.ident == name)?;
    let PathArguments::AngleBracketed(arguments) = &last.arguments else { return None };
    match arguments.args.first()? {
        GenericArgument::Type(inner) => Some(inner),
        _ => None,
    }
}

/// Types whose setter takes exactly them: with a conversion, the type of a literal such as `3` or `[1, 2]` would be open.
fn is_exact(ty: &Type) -> bool {
    const EXACT: [&str; 6] = ["bool", "u8", "u32", "u64", "i64", "usize"];
    match ty {
        Type::Array(_) => true,
        Type::Path(path) => path.path.get_ident().is_some_and(|i| EXACT.iter().any(|e| i == e)),
        _ => false,
    }
}

fn derive_enum(name: &Ident, data: &DataEnum) -> syn::Result<Tokens> {
    let rt = runtime();
    let mut idents = vec![];
    for v in &data.variants {
        if !matches!(v.fields, Fields::Unit) {
            return Err(syn::Error::new_spanned(
                v,
                "the variants of a parameter enum must not have fields",
            ));
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
