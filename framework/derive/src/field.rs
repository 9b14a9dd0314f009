//! `#[field("mobility.ruts")]`: completes an `impl Field`.
use crate::{doc_of, part_type, runtime};
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{ImplItem, ItemImpl, LitStr, parse_quote};

pub fn expand(name: &LitStr, mut item: ItemImpl) -> syn::Result<Tokens> {
    let rt = runtime();
    let doc = doc_of(&item.attrs);
    if doc.is_empty() {
        return Err(syn::Error::new_spanned(
            &item.self_ty,
            "a field needs a doc comment above #[field]: `linkwork describe` shows it",
        ));
    }
    let built = |i: &ImplItem| matches!(i, ImplItem::Fn(f) if f.sig.ident == "build");
    if !item.items.iter().any(built) {
        item.items.push(parse_quote! {
            fn build(p: Self::Params) -> Result<Self, #rt::BuildError> { Ok(Self { p }) }
        });
    }
    let overlay =
        item.items.iter().any(|i| matches!(i, ImplItem::Fn(f) if f.sig.ident == "overlay"));
    item.items.push(parse_quote!(const OVERLAY: bool = #overlay;));
    item.items.push(parse_quote!(const NAME: &'static str = #name;));
    item.items.push(parse_quote!(const DOC: &'static str = #doc;));
    let part_type = part_type(&item, "field");
    Ok(quote!(#item #part_type))
}
