//! `#[derive(Ports)]` and `#[derive(State)]`: a plain struct of f64-like fields as flat lanes.
use crate::{doc_of, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{Data, DeriveInput, Expr, Fields, Ident, LitStr, Token, parse::ParseStream};

#[derive(Default)]
struct PortAttr {
    unit: Option<LitStr>,
    default: Option<Expr>,
    bind: Option<LitStr>,
    frame: Option<LitStr>,
    slider: Option<LitStr>,
    sum: bool,
    group: bool,
    connector: bool,
    direction: Option<&'static str>,
    axle: Option<LitStr>,
    account: Option<&'static str>,
}

fn attribute(field: &syn::Field) -> syn::Result<PortAttr> {
    let mut out = PortAttr::default();
    for attr in field.attrs.iter().filter(|a| a.path().is_ident("port")) {
        if matches!(attr.meta, syn::Meta::Path(_)) {
            continue;
        }
        attr.parse_args_with(|input: ParseStream| parse(&mut out, input))?;
    }
    Ok(out)
}

/// `"unit", slider = "unit", default = 0.0, sum, bind = "shaft", frame = "body", axle = "y", rising | falling, stored | gained | lost`, each optional, in any
/// order; or `group`; or `connector`.
fn parse(out: &mut PortAttr, input: ParseStream) -> syn::Result<()> {
    let start = input.span();
    let mut attributes = 0;
    while !input.is_empty() {
        attributes += 1;
        if input.peek(LitStr) {
            out.unit = Some(input.parse()?);
        } else {
            let key: Ident = input.parse()?;
            match key.to_string().as_str() {
                "sum" => out.sum = true,
                "group" => out.group = true,
                "connector" => (out.group, out.connector) = (true, true),
                "rising" => out.direction = Some("Rising"),
                "falling" => out.direction = Some("Falling"),
                "stored" => out.account = Some("Stored"),
                "gained" => out.account = Some("Gained"),
                "lost" => out.account = Some("Lost"),
                "default" => {
                    input.parse::<Token![=]>()?;
                    out.default = Some(input.parse()?);
                }
                "bind" => {
                    input.parse::<Token![=]>()?;
                    out.bind = Some(input.parse()?);
                }
                "frame" => {
                    input.parse::<Token![=]>()?;
                    out.frame = Some(input.parse()?);
                }
                "slider" => {
                    input.parse::<Token![=]>()?;
                    out.slider = Some(input.parse()?);
                }
                "axle" => {
                    input.parse::<Token![=]>()?;
                    out.axle = Some(input.parse()?);
                }
                _ => {
                    return Err(syn::Error::new(
                        key.span(),
                        "unknown port attribute; known: a unit string, slider, default, bind, frame, axle, sum, group, connector, rising, falling, stored, gained, lost",
                    ));
                }
            }
        }
        if !input.is_empty() {
            input.parse::<Token![,]>()?;
        }
    }
    if out.group && attributes > 1 {
        return Err(syn::Error::new(
            start,
            "a group or connector has no other attributes: unit, default and binding are attributes of its fields",
        ));
    }
    Ok(())
}

pub fn derive(input: &DeriveInput) -> syn::Result<Tokens> {
    let rt = runtime();
    let name = &input.ident;
    let Data::Struct(data) = &input.data else {
        return Err(syn::Error::new_spanned(name, "Ports and State are for structs"));
    };
    let Fields::Named(fields) = &data.fields else {
        return Err(syn::Error::new_spanned(name, "Ports and State need named fields"));
    };
    let (mut specs, mut puts, mut idents, mut types) = (vec![], vec![], vec![], vec![]);
    for field in &fields.named {
        let attr = attribute(field)?;
        let (ident, ty) = (field.ident.as_ref().expect("named"), &field.ty);
        let doc = doc_of(&field.attrs);
        if doc.is_empty() {
            return Err(syn::Error::new_spanned(
                ident,
                "a port needs a doc comment: it is shown to users",
            ));
        }
        let text = ident.to_string();
        let unit = match &attr.unit {
            Some(u) => quote!(Some(#u)),
            None => quote!(None),
        };
        let default = match &attr.default {
            Some(e) => quote!(Some({ let v: #ty = #e; #rt::Lane::lanes_of(&v) })),
            None => quote!(None),
        };
        let opt = |o: &Option<LitStr>| match o {
            Some(s) => quote!(Some(#s)),
            None => quote!(None),
        };
        let (bind, frame, sum) = (opt(&attr.bind), opt(&attr.frame), attr.sum);
        let direction = quote::format_ident!("{}", attr.direction.unwrap_or("Either"));
        let axle = match attr.axle.as_ref().map(|a| (a, a.value())) {
            None => quote!(),
            Some((_, a)) if a == "x" => quote!(.about([1.0, 0.0, 0.0])),
            Some((_, a)) if a == "y" => quote!(.about([0.0, 1.0, 0.0])),
            Some((_, a)) if a == "z" => quote!(.about([0.0, 0.0, 1.0])),
            Some((a, _)) => {
                return Err(syn::Error::new_spanned(a, "an axle must be \"x\", \"y\" or \"z\""));
            }
        };
        let slider = attr.slider.as_ref().map(|unit| quote!(.on_slider(#unit)));
        let account = attr.account.map(|a| {
            let a = quote::format_ident!("{a}");
            quote!(.counted(#rt::Account::#a))
        });
        specs.push(match attr.group {
            true if attr.connector => quote!(out.extend(#rt::PortSpec::connector::<#ty>(#text, #doc));),
            true => quote!(out.extend(#rt::PortSpec::group::<#ty>(#text, #doc));),
            false => quote! {
                out.push(#rt::PortSpec::new::<#ty>(#text, #unit, #doc, #default, #sum, #bind, #frame)
                    .when(#rt::Direction::#direction) #axle #slider #account);
            },
        });
        // A field is a port, or a struct of ports: both have N, get, put and gather.
        let lanes = match attr.group {
            true => quote!(<#ty as #rt::Lanes>),
            false => quote!(<#ty as #rt::Lane>),
        };
        puts.push(quote!(#lanes::put(&self.#ident, &mut s[o..o + #lanes::N]);));
        idents.push(ident);
        types.push(lanes);
    }
    let steps: Vec<Tokens> = types.iter().map(|ty| quote!(o += #ty::N;)).collect();
    let let_get = idents
        .iter()
        .zip(&types)
        .zip(&steps)
        .map(|((i, ty), st)| quote!(let #i = #ty::get(&s[o..o + #ty::N]); #st));
    let let_gather = idents
        .iter()
        .zip(&types)
        .zip(&steps)
        .map(|((i, ty), st)| quote!(let #i = #ty::gather(sig, &idx[o..o + #ty::N]); #st));
    let put_steps = puts.iter().zip(&steps).map(|(p, st)| quote!(#p #st));
    Ok(quote! {
        #[automatically_derived]
        #[allow(unused_assignments, unused_mut, unused_variables)]
        impl #rt::Lanes for #name {
            const N: usize = 0 #(+ #types::N)*;
            fn specs() -> Vec<#rt::PortSpec> {
                let mut out = Vec::new();
                #(#specs)*
                out
            }
            #[inline(always)]
            fn get(s: &[f64]) -> Self {
                let s = &s[..Self::N];
                let mut o = 0usize;
                #(#let_get)*
                Self { #(#idents),* }
            }
            #[inline(always)]
            fn put(&self, s: &mut [f64]) {
                let s = &mut s[..Self::N];
                let mut o = 0usize;
                #(#put_steps)*
            }
            #[inline(always)]
            fn gather(sig: &[f64], idx: &[u32]) -> Self {
                let idx = &idx[..Self::N];
                let mut o = 0usize;
                #(#let_gather)*
                Self { #(#idents),* }
            }
        }
    })
}
