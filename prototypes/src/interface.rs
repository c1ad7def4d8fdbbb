//! Types of interfaces: whether they have the members that a prototype names.

use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::{Member, Type, TypeDeclKind};
use rc_vocabulary::Primitive;

/// A type with the name of the members that prototypes see.
pub(crate) struct Interface<'a> {
    library: &'a Library,
    ty: Type,
}

/// The target of a path.
pub(crate) struct Found {
    ty: Type,
    pub(crate) unit: Option<String>,
}

impl<'a> Interface<'a> {
    /// The type `Module::Name`. Reports one that no import declares.
    pub(crate) fn find(
        library: &'a Library,
        name: &str,
        at: Span,
        found: &mut Diagnostics,
    ) -> Option<Self> {
        let types = || library.modules.iter().flat_map(|module| &module.types);
        let id = types().find(|id| library.type_path(**id) == name);
        let Some(id) = id else {
            let known: Vec<String> = types().map(|id| library.type_path(*id)).collect();
            let message = format!("unknown type `{name}`");
            let diagnostic = Diagnostic::error("unknown-type", at, message);
            found.push(diagnostic.suggest(name, known.iter().map(String::as_str)));
            return None;
        };
        Some(Self {
            library,
            ty: Type::Named(*id),
        })
    }

    fn members(&self, ty: &Type) -> &'a [Member] {
        match self.library.resolved(ty) {
            Type::Named(id) => match &self.library.ty(*id).kind {
                TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => members,
                _ => &[],
            },
            _ => &[],
        }
    }

    /// The target of a path of members and indices. Reports a path without a target.
    pub(crate) fn path(&self, path: &str, at: Span, found: &mut Diagnostics) -> Option<Found> {
        let mut here = Found {
            ty: self.ty.clone(),
            unit: None,
        };
        for word in path.split('.') {
            let length = match self.library.resolved(&here.ty) {
                Type::Array { element, length } => Some((element.as_ref().clone(), *length)),
                _ => None,
            };
            if let Some((element, length)) = length
                && word.parse::<u32>().is_ok_and(|index| index < length)
            {
                here.ty = element;
                continue;
            }
            let members = self.members(&here.ty);
            let Some(member) = members.iter().find(|member| member.name.text == word) else {
                let message = format!("the type has no member `{word}`");
                let known = members.iter().map(|member| member.name.text.as_str());
                let diagnostic = Diagnostic::error("unknown-member", at, message);
                found.push(diagnostic.suggest(word, known));
                return None;
            };
            here = Found {
                ty: member.ty.clone(),
                unit: member.unit.clone(),
            };
        }
        Some(here)
    }

    /// `Module::Name`
    pub(crate) fn name(&self) -> Option<String> {
        match &self.ty {
            Type::Named(id) => Some(self.library.type_path(*id)),
            _ => None,
        }
    }

    /// `Module::Name` of the structure that a member is. Reports an unknown member.
    pub(crate) fn type_at(&self, path: &str, at: Span, found: &mut Diagnostics) -> Option<String> {
        let member = self.path(path, at, found)?;
        match self.library.resolved(&member.ty) {
            Type::Named(id) => Some(self.library.type_path(*id)),
            _ => None,
        }
    }

    /// The numbers of a member that is an array of them.
    pub(crate) fn element(&self, path: &str, at: Span) -> Option<Primitive> {
        let member = self.path(path, at, &mut Diagnostics::new())?;
        let Type::Array { element, .. } = self.library.resolved(&member.ty) else {
            return None;
        };
        match self.library.resolved(element) {
            Type::Primitive(number) if *number != Primitive::Bool => Some(*number),
            _ => None,
        }
    }

    /// The length of a member that is an array.
    pub(crate) fn length(&self, path: &str, at: Span) -> Option<u32> {
        let member = self.path(path, at, &mut Diagnostics::new())?;
        match self.library.resolved(&member.ty) {
            Type::Array { length, .. } => Some(*length),
            _ => None,
        }
    }

    /// The elements of a member, whose members prototypes then name.
    pub(crate) fn elements(&self, path: &str, at: Span, found: &mut Diagnostics) -> Option<Self> {
        let member = self.path(path, at, found)?;
        match self.library.resolved(&member.ty) {
            Type::Sequence { element, .. } | Type::Array { element, .. } => Some(Self {
                library: self.library,
                ty: element.as_ref().clone(),
            }),
            _ => {
                let message = format!("`{path}` is not a sequence");
                found.push(Diagnostic::error("wrong-type", at, message));
                None
            }
        }
    }

    /// The unit of a number, and how it is stored. Reports a member that is none.
    pub(crate) fn number(
        &self,
        path: &str,
        at: Span,
        found: &mut Diagnostics,
    ) -> (Option<String>, Option<Primitive>) {
        let Some(member) = self.path(path, at, found) else {
            return (None, None);
        };
        let number = match self.library.resolved(&member.ty) {
            Type::Primitive(primitive) if *primitive != Primitive::Bool => Some(*primitive),
            _ => None,
        };
        if number.is_none() {
            let message = format!("`{path}` is not a number");
            found.push(Diagnostic::error("wrong-type", at, message));
        }
        (member.unit, number)
    }
}
