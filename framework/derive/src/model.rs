//! `#[model("actuators.dc_motor")]`: completes an `impl Model` or `impl SizedModel`.
//!
//! An author writes each function with the arguments that it reads, in any order. The names of the arguments decide what they
//! receive. The macro moves these functions to an inherent `impl` and writes the functions of the trait, which take all
//! arguments and call them. Tests of the same crate can therefore call the function directly: `motor.feedthrough(&x, &u)`.
use crate::{doc_of, part_type, runtime};
use proc_macro2::{Group, TokenStream as Tokens, TokenTree};
use quote::{ToTokens, format_ident, quote};
use std::collections::BTreeMap;
use syn::{Error, FnArg, ImplItem, ImplItemFn, ItemImpl, LitStr, Pat, Type, parse_quote};

/// A function of a trait: its name and the names of its arguments after `&self`.
type Function = (&'static str, &'static [&'static str]);

/// Functions of `Model`. `!` marks an argument that the function changes.
const FUNCTIONS: [Function; 9] = [
    ("outputs", &["clock", "x", "d", "store"]),
    ("feedthrough", &["clock", "x", "d", "ud", "store"]),
    ("derivatives", &["clock", "x", "d", "u", "ud", "store", "y"]),
    ("update", &["clock", "x", "d", "u", "ud", "store!"]),
    ("guards", &["clock", "x", "d", "u", "ud", "store"]),
    ("handle_event", &["clock", "fired", "x", "d", "u", "ud", "store!"]),
    ("mode", &["clock", "x", "d", "ud", "store"]),
    ("startup_warnings", &["clock", "x", "d", "u", "ud", "store"]),
    ("runtime_warning", &["clock", "fired", "x", "d", "u", "ud", "store"]),
];

/// Functions of `SizedModel`, whose arguments are slices.
const SIZED: [Function; 6] = [
    ("outputs", &["clock", "x", "d", "store", "y!"]),
    ("feedthrough", &["clock", "x", "d", "u", "store", "y!"]),
    ("derivatives", &["clock", "x", "d", "u", "store", "rates!"]),
    ("update", &["clock", "x", "d!", "u", "store!"]),
    ("guards", &["clock", "x", "d", "u", "store", "values!"]),
    ("handle_event", &["clock", "fired", "x!", "d!", "u", "store!"]),
];

/// Associated types of `Model`, and the functions of which one must be written when the type is declared.
const TYPES: [(&str, &[&str]); 9] = [
    ("Params", &[]),
    ("Inputs", &[]),
    ("FeedthroughInputs", &[]),
    ("Outputs", &["outputs"]),
    ("FeedthroughOutputs", &["feedthrough"]),
    ("State", &["derivatives"]),
    ("DiscreteState", &["update", "handle_event"]),
    ("Store", &[]),
    ("Guards", &["guards", "handle_event"]),
];

/// Types and functions that an `impl` declares.
struct Written {
    /// Names of its types and functions.
    names: Vec<String>,
    /// Its associated types.
    types: BTreeMap<String, Type>,
}

impl Written {
    fn of(item: &ItemImpl) -> Self {
        let mut written = Written { names: Vec::new(), types: BTreeMap::new() };
        for part in &item.items {
            match part {
                ImplItem::Type(t) => {
                    written.names.push(t.ident.to_string());
                    written.types.insert(t.ident.to_string(), t.ty.clone());
                }
                ImplItem::Fn(f) => written.names.push(f.sig.ident.to_string()),
                _ => {}
            }
        }
        written
    }
    fn has(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }
    /// Checks that every declared type has a function that makes it.
    fn check(&self, item: &ItemImpl) -> syn::Result<()> {
        for (ty, functions) in TYPES {
            if self.has(ty) && !functions.is_empty() && !functions.iter().any(|f| self.has(f)) {
                let functions = functions.join("` or `fn ");
                let message = format!("`type {ty}` is declared but there is no `fn {functions}`");
                return Err(Error::new_spanned(&item.self_ty, message));
            }
        }
        for function in ["guards", "handle_event", "runtime_warning", "mode"] {
            if self.has(function) && !self.has("Guards") {
                let message = format!(
                    "`fn {function}` needs `type Guards`: a struct of the guards, deriving `Ports`"
                );
                return Err(Error::new_spanned(&item.self_ty, message));
            }
        }
        Ok(())
    }
    /// The argument of the trait that an argument with this name receives: with one struct of inputs, `u` is that one.
    fn argument(&self, name: &str) -> String {
        match name {
            "u" if self.has("FeedthroughInputs") && !self.has("Inputs") => "ud".into(),
            _ => name.into(),
        }
    }
}

pub fn expand(name: &LitStr, item: ItemImpl) -> syn::Result<Tokens> {
    let last = item.trait_.as_ref().and_then(|(_, path, _)| path.segments.last());
    let (part_type, rest) = match last.map(|segment| segment.ident.to_string()).as_deref() {
        Some("Model") => (part_type(&item, "model"), model(name, item)?),
        Some("SizedModel") => (part_type(&item, "sized"), sized(name, item)?),
        _ => {
            return Err(Error::new_spanned(
                &item.self_ty,
                "#[model] must be above an `impl Model` or an `impl SizedModel`",
            ));
        }
    };
    Ok(quote!(#rest #part_type))
}

/// Completes an `impl Model`.
fn model(name: &LitStr, mut item: ItemImpl) -> syn::Result<Tokens> {
    let rt = runtime();
    let doc = documentation(&item)?;
    let written = Written::of(&item);
    written.check(&item)?;
    let moved = take_functions(&mut item, &FUNCTIONS, &written)?;
    let reads = |function: &str, argument: &str| {
        moved.iter().any(|f| f.name == function && f.bound.iter().any(|b| b == argument))
    };
    for function in &moved {
        item.items.push(function.forward(|argument| model_type(argument, &rt)));
    }
    let outputs = reads("derivatives", "y");
    if outputs && !written.has("feedthrough") {
        return Err(Error::new_spanned(
            &item.self_ty,
            "`derivatives` reads the feedthrough outputs (`y`) but there is no `fn feedthrough`",
        ));
    }
    for (ty, _) in TYPES {
        if !written.has(ty) {
            let ident = format_ident!("{ty}");
            item.items.push(parse_quote!(type #ident = ();));
        }
    }
    if !written.has("build") {
        let (argument, body) = if written.has("Params") {
            (quote!(p), quote!(Self { p }))
        } else {
            (quote!(_), quote!(Self {}))
        };
        item.items.push(parse_quote! {
            fn build(#argument: Self::Params) -> Result<Self, #rt::BuildError> { Ok(#body) }
        });
    }
    let [m, d, v, u, g, o] =
        ["outputs", "feedthrough", "derivatives", "update", "guards", "overlay"]
            .map(|f| written.has(f));
    let (tm, td) = (reads("outputs", "clock"), reads("feedthrough", "clock"));
    item.items.push(parse_quote!(const NAME: &'static str = #name;));
    item.items.push(parse_quote!(const DOC: &'static str = #doc;));
    item.items.push(parse_quote! {
        const FUNCTIONS: #rt::Functions = #rt::Functions {
            outputs: #m, feedthrough: #d, derivatives: #v, update: #u, outputs_timed: #tm, feedthrough_timed: #td,
            derivatives_read_outputs: #outputs, feedthrough_after_outputs: false, guards: #g, modes: false, averages: false,
            steps: false, overlay: #o,
        };
    });
    Ok(join(&item, &moved))
}

/// Completes an `impl SizedModel`.
fn sized(name: &LitStr, mut item: ItemImpl) -> syn::Result<Tokens> {
    let rt = runtime();
    let doc = documentation(&item)?;
    let written = Written::of(&item);
    let moved = take_functions(&mut item, &SIZED, &written)?;
    for function in &moved {
        item.items.push(function.forward(|argument| sized_type(argument, &rt)));
    }
    if !written.has("Store") {
        item.items.push(parse_quote!(
            type Store = ();
        ));
    }
    item.items.push(parse_quote!(const NAME: &'static str = #name;));
    item.items.push(parse_quote!(const DOC: &'static str = #doc;));
    Ok(join(&item, &moved))
}

/// The `impl` of the trait, and the inherent one with the functions as they are written.
fn join(item: &ItemImpl, moved: &[Moved]) -> Tokens {
    let (generics, _, bounds) = item.generics.split_for_impl();
    let ty = &item.self_ty;
    let functions = moved.iter().map(|m| &m.function);
    let allowed = quote!(clippy::unused_self, clippy::trivially_copy_pass_by_ref);
    if moved.is_empty() {
        return quote!(#item);
    }
    quote! {
        #[allow(unused_variables)]
        #item
        #[allow(#allowed)]
        impl #generics #ty #bounds { #(#functions)* }
    }
}

fn documentation(item: &ItemImpl) -> syn::Result<String> {
    let doc = doc_of(&item.attrs);
    if doc.is_empty() {
        return Err(Error::new_spanned(
            &item.self_ty,
            "a model needs a doc comment above #[model]: `linkwork describe` shows it",
        ));
    }
    Ok(doc)
}

/// A function that an author wrote.
struct Moved {
    name: &'static str,
    /// Arguments of the trait's function.
    full: &'static [&'static str],
    /// The argument of the trait for each of its arguments.
    bound: Vec<String>,
    /// The function, for the inherent `impl`.
    function: ImplItemFn,
}

impl Moved {
    /// The function of the trait, which calls the written one.
    fn forward(&self, type_of: impl Fn(&str) -> Tokens) -> ImplItem {
        let name = &self.function.sig.ident;
        let arguments = self.full.iter().map(|argument| {
            let (ident, ty) = (format_ident!("{}", plain(argument)), type_of(argument));
            quote!(#ident: #ty)
        });
        let output = &self.function.sig.output;
        let passed = self.bound.iter().map(|argument| format_ident!("{argument}"));
        parse_quote! {
            #[inline(always)]
            fn #name(&self, #(#arguments),*) #output { Self::#name(self, #(#passed),*) }
        }
    }
}

/// Takes the functions of the trait out of an `impl` and binds their arguments by name.
fn take_functions(
    item: &mut ItemImpl,
    functions: &[Function],
    written: &Written,
) -> syn::Result<Vec<Moved>> {
    let mut moved = Vec::new();
    let mut kept = Vec::new();
    for part in std::mem::take(&mut item.items) {
        let ImplItem::Fn(mut f) = part else {
            kept.push(part);
            continue;
        };
        let Some((name, full)) = functions.iter().find(|(n, _)| f.sig.ident == n) else {
            kept.push(ImplItem::Fn(f));
            continue;
        };
        let bound = bind(&f, full, written)?;
        f.vis = parse_quote!(pub(crate));
        f.attrs.push(parse_quote!(#[inline]));
        let tokens = concrete(f.to_token_stream(), &written.types);
        moved.push(Moved { name, full, bound, function: syn::parse2(tokens)? });
    }
    item.items = kept;
    Ok(moved)
}

/// The argument of the trait's function for each argument that is written.
fn bind(f: &ImplItemFn, full: &[&str], written: &Written) -> syn::Result<Vec<String>> {
    let list = full.iter().map(|a| plain(a)).collect::<Vec<_>>().join(", ");
    let of_function = format!("arguments of `{}`, in any order: &self, {list}", f.sig.ident);
    let mut inputs = f.sig.inputs.iter();
    if !matches!(inputs.next(), Some(FnArg::Receiver(r)) if r.mutability.is_none()) {
        return Err(Error::new_spanned(
            &f.sig,
            format!("the first argument must be `&self`; {of_function}"),
        ));
    }
    let mut bound: Vec<String> = Vec::new();
    for input in inputs {
        let name = match input {
            FnArg::Typed(t) => match &*t.pat {
                Pat::Ident(i) => i.ident.to_string(),
                _ => String::new(),
            },
            FnArg::Receiver(_) => String::new(),
        };
        let argument = written.argument(&name);
        if !full.iter().any(|a| plain(a) == argument) {
            return Err(Error::new_spanned(
                input,
                format!("{}; {of_function}", unknown(&name, full, written)),
            ));
        }
        if bound.contains(&argument) {
            return Err(Error::new_spanned(input, format!("`{name}` occurs twice; {of_function}")));
        }
        bound.push(argument);
    }
    Ok(bound)
}

/// Says why no argument has this name.
fn unknown(name: &str, full: &[&str], written: &Written) -> String {
    let unread = name.strip_prefix('_').unwrap_or(name);
    if name.is_empty() || (unread != name && full.iter().any(|a| plain(a) == unread)) {
        return "remove arguments that the function does not read".into();
    }
    if name == "u" && written.has("Inputs") && full.contains(&"ud") {
        return "this function can read only `FeedthroughInputs`: name the argument `ud`".into();
    }
    format!("`{name}` is not an argument of this function")
}

/// Name without the mark of arguments that are changed.
fn plain(argument: &str) -> &str {
    argument.trim_end_matches('!')
}

/// Type of an argument of `Model`.
fn model_type(argument: &str, rt: &Tokens) -> Tokens {
    match argument {
        "clock" => quote!(&#rt::Clock),
        "fired" => quote!(#rt::Fired<'_>),
        "x" => quote!(&Self::State),
        "d" => quote!(&Self::DiscreteState),
        "u" => quote!(&Self::Inputs),
        "ud" => quote!(&Self::FeedthroughInputs),
        "y" => quote!(&Self::FeedthroughOutputs),
        "store!" => quote!(&mut Self::Store),
        _ => quote!(&Self::Store),
    }
}

/// Type of an argument of `SizedModel`.
fn sized_type(argument: &str, rt: &Tokens) -> Tokens {
    match argument {
        "clock" => quote!(&#rt::Clock),
        "fired" => quote!(#rt::Fired<'_>),
        "store" => quote!(&Self::Store),
        "store!" => quote!(&mut Self::Store),
        changed if changed.ends_with('!') => quote!(&mut [f64]),
        _ => quote!(&[f64]),
    }
}

/// Replaces `Self::State` and the like by the declared types: in an inherent `impl` these names are ambiguous.
fn concrete(tokens: Tokens, types: &BTreeMap<String, Type>) -> Tokens {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut out = Tokens::new();
    let mut k = 0;
    while k < tokens.len() {
        if let Some(ty) = associated(&tokens[k..], types) {
            ty.to_tokens(&mut out);
            k += 4;
            continue;
        }
        out.extend([match &tokens[k] {
            TokenTree::Group(group) => {
                let mut inner = Group::new(group.delimiter(), concrete(group.stream(), types));
                inner.set_span(group.span());
                TokenTree::Group(inner)
            }
            token => token.clone(),
        }]);
        k += 1;
    }
    out
}

/// The declared type where these tokens begin with `Self::` and its name.
fn associated<'a>(tokens: &[TokenTree], types: &'a BTreeMap<String, Type>) -> Option<&'a Type> {
    match tokens {
        [
            TokenTree::Ident(own),
            TokenTree::Punct(a),
            TokenTree::Punct(b),
            TokenTree::Ident(name),
            ..,
        ] if own == "Self" && a.as_char() == ':' && b.as_char() == ':' => {
            types.get(&name.to_string())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(item: ItemImpl) -> String {
        expand(&parse_quote!("test.model"), item).unwrap_err().to_string()
    }

    fn expanded(item: ItemImpl) -> String {
        expand(&parse_quote!("test.model"), item).unwrap().to_string().replace(' ', "")
    }

    /// The functions of the trait take all arguments and pass on those that are named, in the order in which they are written.
    #[test]
    fn arguments_are_bound_by_name_in_any_order() {
        let text = expanded(parse_quote! {
            /// A model.
            impl Model for M {
                type FeedthroughInputs = In;
                type FeedthroughOutputs = Out;
                fn feedthrough(&self, u: &In, clock: &Clock) -> Out { Out {} }
            }
        });
        assert!(text.contains("Self::feedthrough(self,ud,clock)"), "{text}");
        assert!(text.contains("pub(crate)fnfeedthrough(&self,u:&In,clock:&Clock)->Out"), "{text}");
        assert!(text.contains("feedthrough_timed:true") && text.contains("outputs_timed:false"));
    }

    /// With both kinds of inputs, `u` and `ud` are different structs; with one kind, `u` is that one.
    #[test]
    fn u_is_the_only_struct_of_inputs() {
        let both = expanded(parse_quote! {
            /// A model.
            impl Model for M {
                type Inputs = A;
                type FeedthroughInputs = B;
                type State = S;
                fn derivatives(&self, ud: &B, u: &A) -> S { S {} }
            }
        });
        assert!(both.contains("Self::derivatives(self,ud,u)"), "{both}");
        let one = expanded(parse_quote! {
            /// A model.
            impl Model for M {
                type Inputs = A;
                type State = S;
                fn derivatives(&self, u: &A) -> Self::State { S {} }
            }
        });
        assert!(one.contains("Self::derivatives(self,u)"), "{one}");
        assert!(one.contains("pub(crate)fnderivatives(&self,u:&A)->S{"), "{one}");
    }

    #[test]
    fn arguments_that_no_function_has_are_rejected_with_the_list() {
        let message = error(parse_quote! {
            /// A model.
            impl Model for M { type State = S; fn derivatives(&self, speed: &A) -> S { S {} } }
        });
        assert!(message.contains("`speed` is not an argument of this function"), "{message}");
        assert!(message.contains("&self, clock, x, d, u, ud, store, y"), "{message}");
        for unread in [quote!(_: &Clock), quote!(_clock: &Clock)] {
            let message = error(parse_quote! {
                /// A model.
                impl Model for M { type State = S; fn derivatives(&self, #unread) -> S { S {} } }
            });
            assert!(message.contains("remove arguments"), "{message}");
        }
        let twice = error(parse_quote! {
            /// A model.
            impl Model for M { type State = S; fn derivatives(&self, x: &S, x: &S) -> S { S {} } }
        });
        assert!(twice.contains("`x` occurs twice"), "{twice}");
    }

    /// `outputs` cannot read inputs, and `feedthrough` only those that are declared as feedthrough inputs.
    #[test]
    fn inputs_reach_only_functions_that_may_read_them() {
        let message = error(parse_quote! {
            /// A model.
            impl Model for M { type Inputs = A; type Outputs = Y; fn outputs(&self, u: &A) -> Y { Y {} } }
        });
        assert!(message.contains("`u` is not an argument of this function"), "{message}");
        let message = error(parse_quote! {
            /// A model.
            impl Model for M {
                type Inputs = A;
                type FeedthroughInputs = B;
                type FeedthroughOutputs = Y;
                fn feedthrough(&self, u: &B) -> Y { Y {} }
            }
        });
        assert!(message.contains("name the argument `ud`"), "{message}");
    }

    #[test]
    fn types_without_their_functions_are_rejected() {
        let message = error(parse_quote! {
            /// A model.
            impl Model for M { type State = S; }
        });
        assert!(message.contains("no `fn derivatives`"), "{message}");
        let message = error(parse_quote! {
            /// A model.
            impl Model for M {
                type State = S;
                fn derivatives(&self, y: &Y) -> S { S {} }
            }
        });
        assert!(message.contains("there is no `fn feedthrough`"), "{message}");
        let message = error(parse_quote! { impl Model for M { type Params = P; } });
        assert!(message.contains("needs a doc comment"), "{message}");
    }
}
