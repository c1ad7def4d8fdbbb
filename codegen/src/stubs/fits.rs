//! Whether a handler of the user has the types that its interface declares.
//!
//! Only certain differences count: an unknown name may denote any type.

use super::source::Code;
use crate::rust::meanings;
use crate::view;
use std::collections::{BTreeMap, BTreeSet};
use syn::{Expr, FnArg, GenericArgument, Lit, PathArguments, ReturnType, Signature, Type};

/// Names that mean the same in every file, unless the user gave them to something else.
const WORDS: [&str; 18] = [
    "BTreeMap", "Context", "Option", "Result", "String", "Vec", "bool", "char", "f32", "f64", "i8",
    "i16", "i32", "i64", "u8", "u16", "u32", "u64",
];

/// The meaning of names.
pub(super) struct Types {
    /// Names that denote another type.
    aliases: BTreeMap<String, Type>,
    /// Names that denote themselves.
    known: BTreeSet<String>,
}

impl Types {
    pub(super) fn of(view: &view::Component, code: &Code) -> Self {
        let (aliases, known) = meanings::of(view);
        let parsed = aliases.into_iter().filter_map(|(name, target)| {
            let target = syn::parse_str(&target).ok()?;
            Some((name, target))
        });
        let mut aliases: Vec<(String, Type)> = parsed.collect();
        let mut names: Vec<String> = WORDS.map(str::to_owned).to_vec();
        names.extend(known);
        // A name with two meanings, or one that the user declares, decides nothing.
        let mut all: Vec<&String> = names.iter().chain(aliases.iter().map(|(n, _)| n)).collect();
        all.sort();
        let twice = all.windows(2).filter(|pair| pair[0] == pair[1]);
        let mut unclear: BTreeSet<String> = twice.map(|pair| pair[0].clone()).collect();
        unclear.extend(code.own.iter().cloned());
        aliases.retain(|(name, _)| !unclear.contains(name));
        names.retain(|name| !unclear.contains(name));
        Self {
            aliases: aliases.into_iter().collect(),
            known: names.into_iter().collect(),
        }
    }

    /// Whether `there` is allowed where `needed` is declared.
    pub(super) fn fit(&self, needed: &str, there: &Signature) -> bool {
        let Ok(needed) = syn::parse_str::<Signature>(needed) else {
            return true;
        };
        let receiver = match there.inputs.first() {
            Some(FnArg::Receiver(receiver)) => {
                let by_reference = receiver.reference.is_some() && receiver.mutability.is_some();
                by_reference || receiver.colon_token.is_some()
            }
            _ => false,
        };
        let inputs = needed.inputs.iter().zip(&there.inputs);
        receiver
            && needed.inputs.len() == there.inputs.len()
            && inputs.skip(1).all(|(needed, there)| match (needed, there) {
                (FnArg::Typed(needed), FnArg::Typed(there)) => self.same(&needed.ty, &there.ty),
                _ => true,
            })
            && self.same_output(&needed.output, &there.output)
    }

    fn same_output(&self, needed: &ReturnType, there: &ReturnType) -> bool {
        match (needed, there) {
            (ReturnType::Default, ReturnType::Default) => true,
            (ReturnType::Type(_, ty), ReturnType::Default)
            | (ReturnType::Default, ReturnType::Type(_, ty)) => {
                let ty = self.meant(ty);
                matches!(ty, Type::Tuple(tuple) if tuple.elems.is_empty()) || !self.is_certain(ty)
            }
            (ReturnType::Type(_, needed), ReturnType::Type(_, there)) => self.same(needed, there),
        }
    }

    fn same(&self, needed: &Type, there: &Type) -> bool {
        let (needed, there) = (self.meant(needed), self.meant(there));
        match (needed, there) {
            (Type::Path(a), Type::Path(b)) => {
                let (Some(a), Some(b)) = (a.path.segments.last(), b.path.segments.last()) else {
                    return true;
                };
                if a.ident == b.ident {
                    return self.same_arguments(&a.arguments, &b.arguments);
                }
                !(self.is_certain(needed) && self.is_certain(there))
            }
            (Type::Reference(a), Type::Reference(b)) => {
                a.mutability.is_some() == b.mutability.is_some() && self.same(&a.elem, &b.elem)
            }
            (Type::Tuple(a), Type::Tuple(b)) => {
                let mut pairs = a.elems.iter().zip(&b.elems);
                a.elems.len() == b.elems.len() && pairs.all(|(a, b)| self.same(a, b))
            }
            (Type::Array(a), Type::Array(b)) => {
                let sizes = (number(&a.len), number(&b.len));
                let differ = matches!(sizes, (Some(a), Some(b)) if a != b);
                !differ && self.same(&a.elem, &b.elem)
            }
            (Type::Slice(a), Type::Slice(b)) => self.same(&a.elem, &b.elem),
            _ => !(self.is_certain(needed) && self.is_certain(there)),
        }
    }

    fn same_arguments(&self, needed: &PathArguments, there: &PathArguments) -> bool {
        let (needed, there) = (types(needed), types(there));
        // `io::Result<T>` is called `Result`, too.
        needed.len() != there.len() || needed.iter().zip(there).all(|(a, b)| self.same(a, b))
    }

    /// The type inside brackets and aliases.
    fn meant<'a>(&'a self, ty: &'a Type) -> &'a Type {
        match ty {
            Type::Paren(inner) => self.meant(&inner.elem),
            Type::Group(inner) => self.meant(&inner.elem),
            Type::Path(path) if path.qself.is_none() => {
                let last = path.path.segments.last();
                let alias = last.and_then(|last| self.aliases.get(&last.ident.to_string()));
                alias.map_or(ty, |target| self.meant(target))
            }
            _ => ty,
        }
    }

    /// Whether this type is none but itself.
    fn is_certain(&self, ty: &Type) -> bool {
        match ty {
            Type::Path(path) if path.qself.is_none() => {
                let last = path.path.segments.last();
                last.is_some_and(|last| self.known.contains(&last.ident.to_string()))
            }
            Type::Reference(_) | Type::Tuple(_) | Type::Array(_) | Type::Slice(_) => true,
            _ => false,
        }
    }
}

/// The types in angle brackets.
fn types(arguments: &PathArguments) -> Vec<&Type> {
    let PathArguments::AngleBracketed(list) = arguments else {
        return Vec::new();
    };
    let types = list.args.iter().filter_map(|argument| match argument {
        GenericArgument::Type(ty) => Some(ty),
        _ => None,
    });
    types.collect()
}

/// The value of a number that is written out.
fn number(expression: &Expr) -> Option<u64> {
    match expression {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Int(number) => number.base10_parse().ok(),
            _ => None,
        },
        _ => None,
    }
}
