//! Semantic checks of resolved declarations.

use crate::ast::Annotation;
use crate::model::{Layout, Library, Primitive, Range, Type, TypeDeclKind, TypeId};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, LiteralKind, Name};
use std::collections::{HashMap, HashSet};

/// Reports equal names. Names that differ only in case count as equal, because they become equal in
/// some target language.
pub(crate) fn duplicates<'a>(
    names: impl Iterator<Item = &'a Name>,
    what: &str,
    found: &mut Diagnostics,
) {
    let mut seen: HashMap<String, &Name> = HashMap::new();
    for name in names {
        let Some(first) = seen.get(&name.text.to_ascii_lowercase()) else {
            seen.insert(name.text.to_ascii_lowercase(), name);
            continue;
        };
        let message = if first.text == name.text {
            format!("{what} `{}` is declared twice", name.text)
        } else {
            format!(
                "{what} `{}` differs only in case from `{}`",
                name.text, first.text
            )
        };
        let error = Diagnostic::error("duplicate-name", name.span, message)
            .label(first.span, "first declared here");
        found.push(if what == "operation" && first.text == name.text {
            error.help("operations are not overloaded: give each a name of its own")
        } else {
            error
        });
    }
}

/// The maximum nesting of named types.
const MAX_NESTING: u32 = 64;

/// Computes the nesting depth and the memory image of the types of one module.
///
/// Reports types that contain themselves. Their members are removed, so that every later traversal
/// of types terminates.
pub(crate) fn nesting(library: &mut Library, types: &[TypeId], found: &mut Diagnostics) {
    let mut cycles = CycleFinder {
        visits: types.iter().map(|id| (*id, Visit::New)).collect(),
        path: Vec::new(),
        reported: HashSet::new(),
    };
    // An explicit stack: a chain of types may be too long for recursion.
    let mut todo: Vec<Step> = types.iter().rev().map(|id| Step::Enter(*id)).collect();
    while let Some(step) = todo.pop() {
        match step {
            Step::Enter(id) => match cycles.visits.get(&id) {
                None | Some(Visit::Done) => {}
                Some(Visit::OnPath) => cycles.report_cycle(library, id, found),
                Some(Visit::New) => {
                    cycles.visits.insert(id, Visit::OnPath);
                    cycles.path.push(id);
                    todo.push(Step::Leave(id));
                    let inner = library.named_in(id);
                    todo.extend(inner.into_iter().rev().map(Step::Enter));
                }
            },
            Step::Leave(id) => {
                cycles.path.pop();
                cycles.visits.insert(id, Visit::Done);
                let inner = library.named_in(id);
                let nesting_depth = inner.iter().map(|t| library.ty(*t).nesting_depth + 1).max();
                let nesting_depth = nesting_depth.unwrap_or(0);
                if nesting_depth > MAX_NESTING {
                    let decl = library.ty(id);
                    let message = format!(
                        "type `{}` is nested more than {MAX_NESTING} levels deep",
                        decl.name.text
                    );
                    found.push(Diagnostic::error(
                        "nested-too-deep",
                        decl.name.span,
                        message,
                    ));
                    library.types[id.0].kind = TypeDeclKind::Struct(Vec::new());
                }
                let image = match &library.ty(id).kind {
                    TypeDeclKind::Enum(_) => Some(Layout::ENUM),
                    TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                        let images = members.iter().map(|m| library.member_image(m));
                        images.collect::<Option<Vec<_>>>().map(Layout::structure)
                    }
                    TypeDeclKind::Alias(ty) => library.image(ty),
                };
                let decl = &mut library.types[id.0];
                (decl.nesting_depth, decl.image) = (nesting_depth.min(MAX_NESTING), image);
            }
        }
    }
    for id in cycles.reported {
        library.types[id.0].kind = TypeDeclKind::Struct(Vec::new());
    }
}

enum Step {
    Enter(TypeId),
    Leave(TypeId),
}

enum Visit {
    New,
    OnPath,
    Done,
}

struct CycleFinder {
    visits: HashMap<TypeId, Visit>,
    path: Vec<TypeId>,
    reported: HashSet<TypeId>,
}

impl CycleFinder {
    /// Reports the cycle of the current path, which returned to `id`.
    fn report_cycle(&mut self, library: &Library, id: TypeId, found: &mut Diagnostics) {
        let start = self.path.iter().position(|t| *t == id).unwrap_or(0);
        let report_cycle = &self.path[start..];
        if !report_cycle.iter().any(|t| self.reported.contains(t)) {
            let name = |t: &TypeId| library.ty(*t).name.text.as_str();
            let names: Vec<&str> = report_cycle
                .iter()
                .chain(report_cycle.first())
                .map(name)
                .collect();
            let message = format!("type `{}` contains itself: {}", names[0], names.join(" → "));
            let span = library.ty(id).name.span;
            found.push(Diagnostic::error("recursive-type", span, message));
        }
        self.reported.extend(report_cycle);
    }
}

pub(crate) fn dictionary_key(library: &Library, key: &Type, span: Span, found: &mut Diagnostics) {
    let allowed = match library.resolved(key) {
        Type::Primitive(primitive) => !primitive.is_float(),
        Type::Text { .. } => true,
        Type::Named(id) => matches!(library.ty(*id).kind, TypeDeclKind::Enum(_)),
        Type::Sequence { .. } | Type::Array { .. } | Type::Dictionary { .. } => false,
    };
    if !allowed {
        let message = "invalid type for the key of a dictionary";
        let help = "use a bool, an integer, a string or an enum";
        found.push(Diagnostic::error("dictionary-key", span, message).help(help));
    }
}

/// Whether `value` is a value of `ty`. Reports an error if not.
pub(crate) fn value_fits(
    library: &Library,
    ty: &Type,
    value: &Literal,
    found: &mut Diagnostics,
) -> bool {
    let what = match library.resolved(ty) {
        Type::Primitive(Primitive::Bool) => match value.kind {
            LiteralKind::Bool(_) => return true,
            LiteralKind::Int(_)
            | LiteralKind::Float(_)
            | LiteralKind::String(_)
            | LiteralKind::Duration(_)
            | LiteralKind::Name(_) => "`true` or `false`".to_owned(),
        },
        Type::Primitive(primitive) => match (primitive.limits(), &value.kind) {
            (Some((min, max)), LiteralKind::Int(v)) if (min..=max).contains(v) => {
                return true;
            }
            (None, LiteralKind::Int(_)) => return true,
            (None, LiteralKind::Float(v)) if primitive.holds(*v) => return true,
            (None, LiteralKind::Float(_)) => {
                format!("a number within the range of `{}`", primitive.word())
            }
            (Some((min, max)), _) => format!("an integer from {min} to {max}"),
            (None, _) => "a number".to_owned(),
        },
        Type::Text { bound } => match (&value.kind, bound) {
            (LiteralKind::String(text), Some(bound)) if text.len() <= *bound as usize => {
                return true;
            }
            (LiteralKind::String(_), None) => return true,
            (_, Some(bound)) => format!("a string of at most {bound} bytes"),
            (_, None) => "a string".to_owned(),
        },
        Type::Named(id) => {
            if let TypeDeclKind::Enum(values) = &library.ty(*id).kind {
                let names = values.iter().map(|v| v.name.text.as_str());
                let LiteralKind::Name(written) = &value.kind else {
                    let message = format!(
                        "expected a value of enum `{}`, found {}",
                        library.ty(*id).name.text,
                        value.described()
                    );
                    found.push(
                        Diagnostic::error("bad-default", value.span, message).suggest("", names),
                    );
                    return false;
                };
                if values.iter().any(|v| v.name.text == *written) {
                    return true;
                }
                let message = format!(
                    "enum `{}` has no value `{written}`",
                    library.ty(*id).name.text
                );
                found.push(
                    Diagnostic::error("bad-default", value.span, message).suggest(written, names),
                );
                return false;
            }
            let message = "a struct cannot have a default value";
            let help = "set the defaults of its members";
            found.push(Diagnostic::error("bad-default", value.span, message).help(help));
            return false;
        }
        Type::Sequence { .. } | Type::Array { .. } | Type::Dictionary { .. } => {
            let message = "sequences, arrays and dictionaries cannot have a default value";
            let help = "remove the default: the initial value is empty or zero";
            found.push(Diagnostic::error("bad-default", value.span, message).help(help));
            return false;
        }
    };
    let message = format!("expected {what}, found {}", value.described());
    found.push(Diagnostic::error("bad-default", value.span, message));
    false
}

/// Whether a range is valid for its type. Reports an error if not.
pub(crate) fn range(
    library: &Library,
    ty: &Type,
    range: &Range,
    annotation: &Annotation,
    found: &mut Diagnostics,
) -> bool {
    let mut report = |message: &str| {
        found.push(Diagnostic::error(
            "bad-range",
            annotation.name.span,
            message,
        ));
        false
    };
    let Type::Primitive(primitive) = library.resolved(ty) else {
        return report("`@range` requires a number");
    };
    if *primitive == Primitive::Bool {
        return report("`@range` requires a number");
    }
    let ends = [&range.min, &range.max];
    if ends.iter().all(|end| end.is_none())
        || annotation.args.len() != ends.iter().flat_map(|e| e.iter()).count()
    {
        return report("expected the arguments `min=` and `max=`: `@range(min=0, max=100)`");
    }
    for end in ends.into_iter().flatten() {
        let fits = match (&end.kind, primitive.limits()) {
            (LiteralKind::Int(value), Some((min, max))) => (min..=max).contains(value),
            (LiteralKind::Int(_), None) => true,
            (LiteralKind::Float(value), None) => primitive.holds(*value),
            _ => false,
        };
        if !fits {
            return report("the limits of `@range` must be numbers of the member's type");
        }
    }
    if let (Some(min), Some(max)) = (&range.min, &range.max)
        && is_less(max, min)
    {
        return report("empty range: `min` is greater than `max`");
    }
    true
}

/// Whether a member can be a stamp. Reports an error if not.
pub(crate) fn stamp(
    library: &Library,
    ty: &Type,
    annotation: &Annotation,
    found: &mut Diagnostics,
) -> bool {
    // The members of a struct that is declared later are not known yet: chains check them.
    let can_be = match library.resolved(ty) {
        Type::Primitive(Primitive::I64 | Primitive::U64) => true,
        Type::Named(id) => matches!(library.ty(*id).kind, TypeDeclKind::Struct(_)),
        _ => false,
    };
    if !can_be {
        let message =
            "`@stamp` requires a `long`, a `uint64`, or a struct of seconds and nanoseconds";
        found.push(Diagnostic::error(
            "bad-stamp",
            annotation.name.span,
            message,
        ));
    }
    can_be
}

fn is_less(a: &Literal, b: &Literal) -> bool {
    let both = a.number().zip(b.number());
    both.is_some_and(|(a, b)| a < b)
}

pub(crate) fn value_in_range(range: &Range, value: &Literal, name: &Name, found: &mut Diagnostics) {
    let below = range.min.as_ref().is_some_and(|min| is_less(value, min));
    let above = range.max.as_ref().is_some_and(|max| is_less(max, value));
    if below || above {
        let message = format!(
            "the default {} of `{}` is outside its range",
            value.number().map_or(String::new(), |n| n.to_string()),
            name.text
        );
        found.push(Diagnostic::error(
            "default-out-of-range",
            value.span,
            message,
        ));
    }
}
