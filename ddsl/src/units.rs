//! Compares the meanings at the two ends of a connection. The wire and its hashes contain no units
//! and no prototypes, so ends with equal types can differ in them.

use crate::conversion::{Conversion, plan};
use crate::converted::effort;
use crate::end::End;
use crate::meaning::{
    Ambiguous, Chosen, Meanings, NotConverted, chosen, described, has_prefix, prototype,
};
use crate::moves::MoveError;
use crate::pair::NoPlan;
use rc_conversion::TREE;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::{Member, Primitive, Type, TypeDeclKind, TypeId};
use rc_plans::Refusal;
use rc_quantity::Unit;
use std::collections::{BTreeSet, HashSet};

/// The `bind` of a connection.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// The location of the connection.
    pub(crate) span: Span,
    /// `bind a.Laser -> b.Laser {`, after which `convert; };` is missing.
    pub(crate) text: &'a str,
    /// The place of `convert;`.
    pub(crate) convert: Option<Span>,
    /// The place of the slot that knows where frames are.
    pub(crate) frames: Option<Span>,
    /// Whether an adaptor connects two middlewares, also if it has nothing to convert.
    pub(crate) bridges: bool,
}

/// Reports members of equal types whose units differ. Returns what the connection converts, and
/// `None` if the units do not agree.
pub(crate) fn compare(
    line: Line<'_>,
    consumer: End,
    provider: End,
    meanings: &Meanings,
    found: &mut Diagnostics,
) -> Option<Conversion> {
    let declared = |end: End| end.library.interface(end.interface).name.span;
    let nothing = Conversion {
        members: Vec::new(),
        plan: rc_conversion::Plan::default(),
        tree: None,
    };
    let says_nothing = |end: End| end.prototypes.prototypes.is_empty();
    if declared(consumer) == declared(provider)
        && (says_nothing(consumer) && says_nothing(provider)
            || std::ptr::eq(consumer.prototypes, provider.prototypes))
    {
        // One declaration in one file.
        warn_without_effect(line, found);
        return Some(nothing);
    }
    let mut comparison = Comparison {
        line,
        consumer,
        provider,
        seen: HashSet::new(),
        is_sent_by_consumer: false,
        agree: true,
        meanings,
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
    match plan(consumer, provider, meanings, line.frames.is_some()) {
        Ok(conversion) => {
            if conversion.members.is_empty() {
                warn_without_effect(line, found);
            } else if !conversion.needs_frames()
                && let Some(span) = line.frames
            {
                let message = "`frames` has no effect: no frame changes";
                let warning = Diagnostic::warning("nothing-to-convert", span, message);
                found.push(warning.help("remove it"));
            }
            Some(conversion)
        }
        Err(reason) => {
            let (message, help) = match reason {
                NoPlan::TooLarge => (
                    format!(
                        "`{}` has an interface of too many members to convert",
                        consumer.name
                    ),
                    "a plan has at most 8192 values in 32 levels, and 64 KiB as a text: convert in a component, or divide the interface",
                ),
                NoPlan::Place(path) => (
                    format!(
                        "`{path}` has a prototype whose numbers are not where a connection can convert them"
                    ),
                    "its numbers must be members of the structure, of structures in it, or of arrays of numbers",
                ),
                NoPlan::Move(path, MoveError::Repeated) => (
                    format!("`{path}` has a frame that changes, and occurs in a sequence"),
                    "give the prototype to the structure around it: `sequence = member NAME`",
                ),
                NoPlan::Move(path, MoveError::Time) => (
                    format!("the `stamp` of `{path}` is not a time"),
                    "name a number with `@unit` s, ms, us or ns, or a structure of seconds and nanoseconds",
                ),
                NoPlan::Move(path, MoveError::Frame) => (
                    format!("the frame of `{path}` is not a string"),
                    "name a member with the name of the frame, or the frame itself",
                ),
                NoPlan::Move(path, MoveError::InPlace) => (
                    format!("`{path}` travels in place, and its frame is a string in it"),
                    "name the frame in the prototype, or let the string have no bound",
                ),
                NoPlan::Move(path, MoveError::Hidden) => (
                    format!("the frame or the `stamp` of `{path}` is not in every message once"),
                    "name members that are neither optional nor in a sequence",
                ),
            };
            let span = line.convert.unwrap_or(line.span);
            found.push(Diagnostic::error("not-convertible", span, message).help(help));
            None
        }
    }
}

/// Warns of a `convert;` that converts nothing.
fn warn_without_effect(line: Line<'_>, found: &mut Diagnostics) {
    if let Some(span) = line.convert.filter(|_| !line.bridges) {
        let message = "`convert` has no effect: both ends mean the same";
        found.push(Diagnostic::warning("nothing-to-convert", span, message).help("remove it"));
    }
}

struct Comparison<'a, 'f> {
    line: Line<'a>,
    consumer: End<'a>,
    provider: End<'a>,
    /// Types whose members are compared, by their number in the consumer's library, with the
    /// prototypes that a member chooses, and the direction.
    seen: HashSet<(TypeId, [Option<&'a str>; 2], bool)>,
    /// Whether the values that are compared travel from the consumer to the provider.
    is_sent_by_consumer: bool,
    agree: bool,
    meanings: &'a Meanings,
    found: &'f mut Diagnostics,
}

/// Members of a structure that a formula converts: their units belong to its prototype.
#[derive(Clone, Copy)]
struct ConvertedMembers<'m> {
    members: &'m BTreeSet<String>,
    /// The path of the members that are compared.
    prefix: &'m str,
}

impl<'a> Comparison<'a, '_> {
    fn operation(&mut self, at: usize) {
        let operation = |end: End<'a>| &end.library.interface(end.interface).operations[at];
        let (ours, theirs) = (operation(self.consumer), operation(self.provider));
        let path = ours.name.text.as_str();
        self.is_sent_by_consumer = !self.consumer.subscribes;
        self.members(path, (None, None), &ours.inputs, &theirs.inputs, None);
        self.is_sent_by_consumer = false;
        self.members(path, (None, None), &ours.outputs, &theirs.outputs, None);
        if let (Some(one), Some(other)) = (&ours.result, &theirs.result) {
            self.types(one, other, (None, None), None);
        }
        for (one, other) in ours.throws.iter().zip(&theirs.throws) {
            self.declarations(*one, *other, (None, None), None);
        }
    }

    /// Compares members of equal types, which are those of `path`.
    fn members(
        &mut self,
        path: &str,
        whole: (Option<TypeId>, Option<TypeId>),
        ours: &'a [Member],
        theirs: &'a [Member],
        meant: Option<ConvertedMembers<'_>>,
    ) {
        for (one, other) in ours.iter().zip(theirs) {
            let own = meant.map(|of| format!("{}{}", of.prefix, one.name.text));
            let below = own.as_ref().map(|own| format!("{own}."));
            let inner = meant
                .zip(below.as_deref())
                .map(|(of, prefix)| ConvertedMembers {
                    members: of.members,
                    prefix,
                });
            let has_parts = inner.is_some_and(|of| has_prefix(of.members, of.prefix));
            let is_number = meant
                .zip(own.as_ref())
                .is_some_and(|(of, own)| of.members.contains(own));
            if !is_number && !has_parts {
                self.member(path, one, other);
            }
            let chosen = (
                chosen(self.consumer, whole.0, one),
                chosen(self.provider, whole.1, other),
            );
            self.types(&one.ty, &other.ty, chosen, inner.filter(|_| has_parts));
        }
    }

    fn types(
        &mut self,
        one: &'a Type,
        other: &'a Type,
        chosen: (Chosen<'a>, Chosen<'a>),
        meant: Option<ConvertedMembers<'_>>,
    ) {
        match (one, other) {
            (Type::Named(one), Type::Named(other)) => {
                self.declarations(*one, *other, chosen, meant);
            }
            (Type::Sequence { element: one, .. }, Type::Sequence { element: other, .. })
            | (Type::Array { element: one, .. }, Type::Array { element: other, .. }) => {
                self.types(one, other, chosen, None);
            }
            (
                Type::Dictionary { key, value },
                Type::Dictionary {
                    key: other_key,
                    value: other_value,
                },
            ) => {
                self.types(key, other_key, (None, None), None);
                self.types(value, other_value, chosen, None);
            }
            (
                Type::Primitive(_)
                | Type::Text { .. }
                | Type::Sequence { .. }
                | Type::Array { .. }
                | Type::Dictionary { .. }
                | Type::Named(_),
                _,
            ) => {}
        }
    }

    fn declarations(
        &mut self,
        one: TypeId,
        other: TypeId,
        chosen: (Chosen<'a>, Chosen<'a>),
        meant: Option<ConvertedMembers<'_>>,
    ) {
        let names = [chosen.0, chosen.1].map(|of| of.map(|of| of.name.as_str()));
        // Members of a part that belongs to a whole are compared with the whole.
        if meant.is_none() && !self.seen.insert((one, names, self.is_sent_by_consumer)) {
            return;
        }
        let (ours, theirs) = (self.consumer.library, self.provider.library);
        match (&ours.ty(one).kind, &theirs.ty(other).kind) {
            (
                TypeDeclKind::Struct(a) | TypeDeclKind::Exception(a),
                TypeDeclKind::Struct(b) | TypeDeclKind::Exception(b),
            ) => {
                let path = ours.type_path(one);
                let whole = (Some(one), Some(other));
                if meant.is_some() {
                    self.members(&path, whole, a, b, meant);
                    return;
                }
                let members = self.meaning(&path, (one, other), chosen);
                let meant = members.as_ref().map(|members| ConvertedMembers {
                    members,
                    prefix: "",
                });
                self.members(&path, whole, a, b, meant);
            }
            (TypeDeclKind::Alias(a), TypeDeclKind::Alias(b)) => self.types(a, b, chosen, meant),
            (
                TypeDeclKind::Enum(_)
                | TypeDeclKind::Struct(_)
                | TypeDeclKind::Exception(_)
                | TypeDeclKind::Alias(_),
                _,
            ) => {}
        }
    }

    /// Compares the meanings of a structure. Returns the members whose units belong to its
    /// prototypes.
    fn meaning(
        &mut self,
        path: &str,
        (one, other): (TypeId, TypeId),
        chosen: (Chosen<'a>, Chosen<'a>),
    ) -> Option<BTreeSet<String>> {
        let (consumer, provider) = (self.consumer, self.provider);
        let own = prototype(consumer, one, chosen.0);
        let their = prototype(provider, other, chosen.1);
        let declarations = (
            consumer.library.ty(one).name.span,
            provider.library.ty(other).name.span,
        );
        let (own, their) = match (own, their) {
            (Ok(None), Ok(None) | Err(_)) | (Err(_), Ok(None)) => return None,
            (Ok(own), Ok(their)) => (own, their),
            (Err(Ambiguous(names)), _) => return self.ambiguous(consumer, path, &names),
            (_, Err(Ambiguous(names))) => return self.ambiguous(provider, path, &names),
        };
        let (Some(own), Some(their)) = (own, their) else {
            let (with, without) = if own.is_some() {
                (consumer, provider)
            } else {
                (provider, consumer)
            };
            let says = own
                .or(their)
                .map_or(String::new(), |of| described(with, of));
            let message = format!(
                "`{}` has `{path}` as {says}, but `{}` does not say what it means",
                with.name, without.name
            );
            let warning = Diagnostic::warning("meaning-missing", self.line.span, message).help(
                "let the other component import a `.dproto` with a prototype of this type, too",
            );
            self.report_at(warning, declarations);
            return None;
        };
        let (from, to) = if self.is_sent_by_consumer {
            ((consumer, own), (provider, their))
        } else {
            ((provider, their), (consumer, own))
        };
        let (wants, sends) = if consumer.subscribes {
            ("expects", "sends")
        } else {
            ("has", "has")
        };
        let message = format!(
            "`{}` {wants} `{path}` as {}, but `{}` {sends} it as {}",
            consumer.name,
            described(consumer, own),
            provider.name,
            described(provider, their)
        );
        let moves = self.line.frames.is_some();
        let error = match self.meanings.of(from, to, moves).as_ref() {
            Ok(meaning) => {
                if !meaning.is_identity && self.line.convert.is_none() {
                    let help = format!(
                        "they mean the same: `{} convert; }};` converts ({})",
                        self.line.text, meaning.what
                    );
                    let error = Diagnostic::error(meaning.code, self.line.span, message);
                    self.agree = false;
                    self.report_at(error.help(help), declarations);
                }
                return Some(meaning.members.clone());
            }
            Err(NotConverted::Refused(refusal)) => {
                let message = format!("{message}: {refusal}");
                let error = Diagnostic::error(refusal.code(), self.line.span, message);
                match refusal {
                    Refusal::Frame(end, ..) if end == "with_respect_to" && consumer.subscribes => {
                        error.help(if self.line.frames.is_some() {
                            "name the frame and the `stamp` in the prototype of the whole, and not in those of its parts".to_owned()
                        } else {
                            format!("a tree knows it, if a slot of the subscriber requires `{TREE}`; so do tf and its shared world: `{} convert {{ frames SLOT; }}; }};`",
                            self.line.text
                        )
                        })
                    }
                    _ => error,
                }
            }
            Err(NotConverted::Stamp(name)) => {
                let message =
                    format!("{message}: `{name}` does not say when its values were measured");
                let error = Diagnostic::error("no-conversion", self.line.span, message);
                error.help(
                    "a change of frames is one at a time: `frames = { …, stamp = member NAME }`",
                )
            }
            Err(NotConverted::FrameName(name)) => {
                let message = format!("{message}: a frame named `{name}` cannot change");
                let error = Diagnostic::error("no-conversion", self.line.span, message);
                error.help("names of frames have letters, digits, `_`, `.`, `/` and `-`")
            }
            Err(NotConverted::Covariance) => {
                let message = format!("{message}: the covariance would stay as it is");
                let error = Diagnostic::error("no-conversion", self.line.span, message);
                error.help("a connection converts a covariance that both ends have, as an array of numbers")
            }
            Err(NotConverted::Places(name)) => {
                let message =
                    format!("{message}: `{name}` does not say which members hold its parts");
                let error = Diagnostic::error("no-conversion", self.line.span, message);
                error.help("name them: `ddr = :: IDSL{TYPE} dr = { MEMBER = PART }`")
            }
            Err(NotConverted::Function(function)) => {
                let message = format!("{message}: the function `{function}` would have to convert");
                let error = Diagnostic::error("no-conversion", self.line.span, message);
                error.help("a connection calls no function: convert in a component")
            }
        };
        self.agree = false;
        self.report_at(error, declarations);
        None
    }

    /// Reports several prototypes of one type, of which none is chosen.
    fn ambiguous(
        &mut self,
        end: End<'_>,
        path: &str,
        names: &[String],
    ) -> Option<BTreeSet<String>> {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let message = format!(
            "`{}` has several prototypes of `{path}`: {}",
            end.name,
            names.join(", ")
        );
        let error = Diagnostic::error("ambiguous-prototype", self.line.span, message);
        self.found.push(error.help(
            "choose one in the `.idsl`: `@dproto(\"NAME\")` before the structure, the member or the parameter",
        ));
        self.agree = false;
        None
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
                        "{quantity}: `{} convert; }};` converts ({})",
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
        self.report_at(diagnostic, (ours.name.span, theirs.name.span));
    }

    fn report_at(&mut self, diagnostic: Diagnostic, (ours, theirs): (Span, Span)) {
        let diagnostic = diagnostic
            .label(ours, "the consumer's declaration")
            .label(theirs, "the provider's declaration");
        self.found.push(diagnostic);
    }
}

/// The numbers to which the unit of a member applies: the member itself, or the elements of
/// sequences, arrays and dictionaries. `None` if there are none.
fn numbers(library: &Library, ty: &Type) -> Option<Primitive> {
    match library.resolved(ty) {
        Type::Primitive(number) => number.number().map(|_| *number),
        Type::Sequence { element, .. } | Type::Array { element, .. } => numbers(library, element),
        Type::Dictionary { value, .. } => numbers(library, value),
        Type::Named(_) | Type::Text { .. } => None,
    }
}
