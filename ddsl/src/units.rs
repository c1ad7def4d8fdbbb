//! Whether the two ends of a connection mean the same units. The wire and its hashes know no
//! units, so ends whose types are equal can differ in them.

use crate::conversion::{Conversion, NoPlan, effort, kind, plan};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, Member, Primitive, Type, TypeDeclKind, TypeId};
use rc_quantity::Unit;
use std::collections::HashSet;

/// One end of a connection.
#[derive(Clone, Copy)]
pub(crate) struct End<'a> {
    /// `INSTANCE.SLOT`
    pub(crate) name: &'a str,
    pub(crate) library: &'a Library,
    pub(crate) interface: InterfaceId,
    /// Whether it is a consumer of topics, which receives all values.
    pub(crate) subscribes: bool,
}

/// The `bind` of a connection.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// The location of the connection.
    pub(crate) span: Span,
    /// `bind a.Laser -> b.Laser`
    pub(crate) text: &'a str,
    /// Where `convert;` stands.
    pub(crate) convert: Option<Span>,
}

/// Reports members of equal types whose units differ. Returns what the connection converts, and
/// `None` if the units do not agree.
pub(crate) fn compare(
    line: Line<'_>,
    consumer: End,
    provider: End,
    found: &mut Diagnostics,
) -> Option<Conversion> {
    let declared = |end: End| end.library.interface(end.interface).name.span;
    let nothing = Conversion {
        members: Vec::new(),
        plan: rc_conversion::Plan::default(),
    };
    if declared(consumer) == declared(provider) {
        // One declaration in one file.
        warn_without_effect(line, found);
        return Some(nothing);
    }
    let mut comparison = Comparison {
        line,
        consumer,
        provider,
        seen: HashSet::new(),
        agree: true,
        found,
    };
    let operations = |end: End<'_>| end.library.interface(end.interface).operations.len();
    for at in 0..operations(consumer).min(operations(provider)) {
        comparison.operation(at);
    }
    if !comparison.agree {
        return None;
    }
    if line.convert.is_none() {
        return Some(nothing);
    }
    match plan(consumer, provider) {
        Ok(conversion) => {
            if conversion.members.is_empty() {
                warn_without_effect(line, found);
            }
            Some(conversion)
        }
        Err(NoPlan::TooLarge) => {
            let message = format!(
                "`{}` has an interface of too many members to convert",
                consumer.name
            );
            let span = line.convert.unwrap_or(line.span);
            let error = Diagnostic::error("not-convertible", span, message);
            found.push(error.help("a plan has at most 8192 values in 32 levels: convert in a component, or divide the interface"));
            None
        }
    }
}

/// Warns of a `convert;` that converts nothing.
fn warn_without_effect(line: Line<'_>, found: &mut Diagnostics) {
    if let Some(span) = line.convert {
        let message = "`convert` has no effect: both ends have the same units";
        found.push(Diagnostic::warning("nothing-to-convert", span, message).help("remove it"));
    }
}

struct Comparison<'a, 'f> {
    line: Line<'a>,
    consumer: End<'a>,
    provider: End<'a>,
    /// Types whose members are compared, by their number in the consumer's library.
    seen: HashSet<TypeId>,
    agree: bool,
    found: &'f mut Diagnostics,
}

impl<'a> Comparison<'a, '_> {
    fn operation(&mut self, at: usize) {
        let operation = |end: End<'a>| &end.library.interface(end.interface).operations[at];
        let (ours, theirs) = (operation(self.consumer), operation(self.provider));
        let path = ours.name.text.as_str();
        self.members(path, &ours.inputs, &theirs.inputs);
        self.members(path, &ours.outputs, &theirs.outputs);
        if let (Some(one), Some(other)) = (&ours.result, &theirs.result) {
            self.types(one, other);
        }
        for (one, other) in ours.throws.iter().zip(&theirs.throws) {
            self.declarations(*one, *other);
        }
    }

    /// Compares members of equal types, which are those of `path`.
    fn members(&mut self, path: &str, ours: &[Member], theirs: &[Member]) {
        for (one, other) in ours.iter().zip(theirs) {
            self.member(path, one, other);
            self.types(&one.ty, &other.ty);
        }
    }

    fn types(&mut self, one: &Type, other: &Type) {
        match (one, other) {
            (Type::Named(one), Type::Named(other)) => self.declarations(*one, *other),
            (Type::Sequence(one, _), Type::Sequence(other, _))
            | (Type::Array(one, _), Type::Array(other, _)) => self.types(one, other),
            (Type::Dictionary(key, value), Type::Dictionary(other_key, other_value)) => {
                self.types(key, other_key);
                self.types(value, other_value);
            }
            _ => {}
        }
    }

    fn declarations(&mut self, one: TypeId, other: TypeId) {
        if !self.seen.insert(one) {
            return;
        }
        let (ours, theirs) = (self.consumer.library, self.provider.library);
        match (&ours.ty(one).kind, &theirs.ty(other).kind) {
            (
                TypeDeclKind::Struct(a) | TypeDeclKind::Exception(a),
                TypeDeclKind::Struct(b) | TypeDeclKind::Exception(b),
            ) => self.members(&ours.type_path(one), a, b),
            (TypeDeclKind::Alias(a), TypeDeclKind::Alias(b)) => self.types(a, b),
            _ => {}
        }
    }

    fn member(&mut self, path: &str, ours: &Member, theirs: &Member) {
        let (here, there) = match (&ours.unit, &theirs.unit) {
            (None, None) => return,
            (Some(here), Some(there)) => (here, there),
            (here, there) => {
                let unit = here.as_ref().or(there.as_ref()).map_or("", String::as_str);
                let (with, without) = match here {
                    Some(_) => (self.consumer.name, self.provider.name),
                    None => (self.provider.name, self.consumer.name),
                };
                let message = format!(
                    "`{with}` has `{path}.{}` in {unit}, but `{without}` says no unit",
                    ours.name.text
                );
                self.report(
                    Diagnostic::warning("unit-missing", self.line.span, message).help(format!(
                        "if it is in {unit}, write `@unit(\"{unit}\")` in the other file, too"
                    )),
                    ours,
                    theirs,
                );
                return;
            }
        };
        let parsed = (Unit::parse(here), Unit::parse(there));
        let help = match parsed {
            (Ok(one), Ok(other)) if one == other => return,
            (Ok(one), Ok(other)) => match other.conversion_to(&one) {
                Some(conversion) => {
                    let quantity = format!(
                        "they mean the same quantity ({}; {there} {conversion} = {here})",
                        one.dimension()
                    );
                    let numbers = numbers(self.consumer.library, &ours.ty);
                    let Some(number) = numbers else {
                        self.mismatch(path, (ours, here), (theirs, there), format!("{quantity}, but a unit converts numbers only: give units to the members of its structure"));
                        return;
                    };
                    if self.line.convert.is_some() {
                        return;
                    }
                    format!(
                        "{quantity}: `{} {{ convert; }};` converts ({})",
                        self.line.text,
                        effort(&conversion, number)
                    )
                }
                None => format!(
                    "{here} measures {}, {there} measures {}: connect a provider of the same quantity",
                    one.dimension(),
                    other.dimension()
                ),
            },
            _ if here.trim() == there.trim() => return,
            _ => "units that are not in the table must be equal as texts".to_owned(),
        };
        self.mismatch(path, (ours, here), (theirs, there), help);
    }

    /// Reports a member whose units differ.
    fn mismatch(
        &mut self,
        path: &str,
        (ours, here): (&Member, &str),
        (theirs, there): (&Member, &str),
        help: String,
    ) {
        self.agree = false;
        let (wants, sends) = if self.consumer.subscribes {
            ("expects", "sends")
        } else {
            ("has", "has")
        };
        let message = format!(
            "`{}` {wants} `{path}.{}` in {here}, but `{}` {sends} it in {there}",
            self.consumer.name, ours.name.text, self.provider.name
        );
        self.report(
            Diagnostic::error("unit-mismatch", self.line.span, message).help(help),
            ours,
            theirs,
        );
    }

    fn report(&mut self, diagnostic: Diagnostic, ours: &Member, theirs: &Member) {
        let diagnostic = diagnostic
            .label(ours.name.span, "the consumer's declaration")
            .label(theirs.name.span, "the provider's declaration");
        self.found.push(diagnostic);
    }
}

/// The numbers that the unit of a member is for: the member itself, or the elements of sequences,
/// arrays and dictionaries. `None` if there are none.
fn numbers(library: &Library, ty: &Type) -> Option<Primitive> {
    match library.resolved(ty) {
        Type::Primitive(number) => kind(*number).map(|_| *number),
        Type::Sequence(element, _) | Type::Array(element, _) => numbers(library, element),
        Type::Dictionary(_, value) => numbers(library, value),
        Type::Named(_) | Type::String(_) => None,
    }
}
