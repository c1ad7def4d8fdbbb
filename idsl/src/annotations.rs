//! Annotations: `@unit`, `@dproto`, `@range`, `@default`, `@optional`, `@stamp` and
//! `@ros`.

use crate::ast::{self, Decl, DeclKind};
use crate::check;
use crate::model::{Member, Range};
use crate::resolver::ModuleResolver;
use rc_diagnostics::Diagnostic;
use rc_syntax::{Literal, LiteralKind, Name};

/// The annotations that members and parameters accept.
const MEMBER_ANNOTATIONS: [&str; 6] = ["unit", "dproto", "range", "default", "optional", "stamp"];
/// The annotations that modules, structs and operations accept.
const ALL_ANNOTATIONS: [&str; 7] = [
    "unit", "dproto", "range", "default", "optional", "stamp", "ros",
];

impl ModuleResolver<'_> {
    pub(crate) fn annotate(&mut self, member: &mut Member, annotation: &ast::Annotation) {
        let text = annotation.name.text.as_str();
        let first = annotation.args.first().map(|(_, literal)| literal.clone());
        match (text, first) {
            ("optional", None) => member.optional = true,
            ("stamp", None) => {
                if check::stamp(self.library, &member.ty, annotation, self.found) {
                    member.stamp = true;
                }
            }
            (
                "unit",
                Some(Literal {
                    kind: LiteralKind::String(unit),
                    span,
                }),
            ) => {
                if let Some(warning) = rc_syntax::unknown_unit(&unit, span) {
                    self.report(warning);
                }
                member.unit = Some(unit);
            }
            (
                "dproto",
                Some(Literal {
                    kind: LiteralKind::String(name),
                    span,
                }),
            ) => member.prototype = Some(Name::new(name, span)),
            ("default", Some(value)) => member.default = Some(value),
            ("range", Some(_)) => {
                let end = |wanted: &str| {
                    let arg = annotation
                        .args
                        .iter()
                        .find(|(n, _)| n.as_ref().is_some_and(|n| n.text == wanted));
                    arg.map(|(_, literal)| literal.clone())
                };
                let range = Range {
                    min: end("min"),
                    max: end("max"),
                };
                if check::range(self.library, &member.ty, &range, annotation, self.found) {
                    member.range = Some(range);
                }
            }
            ("optional" | "stamp" | "unit" | "dproto" | "default" | "range", _) => {
                let message = match text {
                    "optional" => "`@optional` takes no argument",
                    "stamp" => "`@stamp` takes no argument",
                    "unit" => "`@unit` takes one string: `@unit(\"m/s\")`",
                    "dproto" => "`@dproto` takes one string: `@dproto(\"point\")`",
                    "default" => "`@default` takes one value: `@default(0)`",
                    _ => "`@range` takes `min=` and `max=`: `@range(min=0, max=100)`",
                };
                self.report(Diagnostic::error(
                    "annotation-arguments",
                    annotation.name.span,
                    message,
                ));
            }
            _ => self.warn_ignored(annotation, &MEMBER_ANNOTATIONS),
        }
    }

    /// Warns of an annotation that has no meaning here. The known annotations of members are
    /// accepted on structs and operations, as documentation.
    fn warn_ignored(&mut self, annotation: &ast::Annotation, known: &[&str]) {
        let text = annotation.name.text.as_str();
        if known.contains(&text) {
            return;
        }
        let report =
            |message| Diagnostic::warning("unknown-annotation", annotation.name.span, message);
        self.report(if text == "ros" {
            report("`@ros` is ignored here".to_owned())
                .help("move it before a module, a struct or an operation")
        } else {
            report(format!("unknown annotation `@{text}`")).suggest(text, known.iter().copied())
        });
    }

    /// The arguments of all `@ros` annotations.
    pub(crate) fn ros_names(&mut self, annotations: &[ast::Annotation]) -> Vec<Name> {
        let mut all = Vec::new();
        for annotation in annotations {
            if annotation.name.text != "ros" {
                self.warn_ignored(annotation, &ALL_ANNOTATIONS);
                continue;
            }
            match annotation.args.as_slice() {
                [
                    (
                        None,
                        Literal {
                            kind: LiteralKind::String(text),
                            span,
                        },
                    ),
                ] => all.push(Name::new(text.clone(), *span)),
                _ => self.report(Diagnostic::error(
                    "annotation-arguments",
                    annotation.name.span,
                    "`@ros` takes one string: `@ros(\"sensor_msgs/msg/LaserScan\")`",
                )),
            }
        }
        all
    }

    /// The argument of `@ros`, which may occur once.
    pub(crate) fn single_ros_name(&mut self, annotations: &[ast::Annotation]) -> Option<Name> {
        let mut all = self.ros_names(annotations).into_iter();
        let first = all.next();
        for other in all {
            let message = "duplicate annotation `@ros`";
            let diagnostic = Diagnostic::error("annotation-arguments", other.span, message);
            let first = first.as_ref().map_or(other.span, |first| first.span);
            self.report(diagnostic.label(first, "first used here"));
        }
        first
    }

    /// The ROS 2 type that a struct declares with `@ros`.
    pub(crate) fn ros_type(&mut self, decl: &Decl) -> Option<Name> {
        if matches!(decl.kind, DeclKind::Struct(_)) {
            return self.single_ros_name(&decl.annotations);
        }
        for annotation in &decl.annotations {
            self.warn_ignored(annotation, &MEMBER_ANNOTATIONS);
        }
        None
    }

    /// The data prototype that a struct names with `@dproto`. Other types have none, which
    /// [`Self::ros_type`] reports.
    pub(crate) fn prototype(&mut self, decl: &Decl) -> Option<Name> {
        if !matches!(decl.kind, DeclKind::Struct(_)) {
            return None;
        }
        let mut named = decl.annotations.iter().filter(|a| a.name.text == "dproto");
        let annotation = named.next()?;
        if let ([(None, literal)], None) = (annotation.args.as_slice(), named.next())
            && let LiteralKind::String(name) = &literal.kind
        {
            return Some(Name::new(name.clone(), literal.span));
        }
        self.report(Diagnostic::error(
            "annotation-arguments",
            annotation.name.span,
            "`@dproto` takes one string, and stands once: `@dproto(\"point\")`",
        ));
        None
    }
}
