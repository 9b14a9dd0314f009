//! `#[service("environment.height_field", Terrain)]`: completes an `impl Service`.
use crate::{doc_of, part_type, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{ItemImpl, LitStr, Path, Token, parse::ParseStream, parse_quote};

/// Name in the catalogue and the trait that is provided.
pub struct Attr {
    name: LitStr,
    kind: Path,
}

impl syn::parse::Parse for Attr {
    fn parse(input: ParseStream) -> syn::Result<Self> {
        let name = input.parse()?;
        input.parse::<Token![,]>()?;
        Ok(Self { name, kind: input.parse()? })
    }
}

pub fn expand(attr: &Attr, mut item: ItemImpl) -> syn::Result<Tokens> {
    let rt = runtime();
    let doc = doc_of(&item.attrs);
    if doc.is_empty() {
        return Err(syn::Error::new_spanned(
            &item.self_ty,
            "a service needs a doc comment above #[service]: `linkwork describe` shows it",
        ));
    }
    let (name, kind) = (&attr.name, &attr.kind);
    item.items.push(parse_quote!(const NAME: &'static str = #name;));
    item.items.push(parse_quote!(const DOC: &'static str = #doc;));
    item.items.push(parse_quote!(type Provides = dyn #kind;));
    item.items.push(parse_quote! {
        fn object(self) -> #rt::ServiceObject {
            #rt::ServiceObject::new::<Self::Provides>(::std::sync::Arc::new(self))
        }
    });
    let part_type = part_type(&item, "service");
    Ok(quote!(#item #part_type))
}
