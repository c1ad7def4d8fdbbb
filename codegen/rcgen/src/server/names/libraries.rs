//! Names of IDSL modules: types, members, enumerators, and what their types are.

use super::{Collector, Kind};
use rc_diagnostics::Name;
use rc_idsl::model::{Library, Member, Reference, TypeDeclKind, TypeId};

impl Collector<'_> {
    pub(super) fn library(&mut self, library: &Library) {
        for (span, reference) in &library.references {
            let symbol = match reference {
                Reference::Module(id) => self.module(library, *id),
                Reference::Type(id) => self.ty(library, *id),
            };
            self.refers(*span, symbol);
        }
        for module in &library.modules {
            if self.file(module.source) != self.path {
                continue;
            }
            let symbols = vec![
                self.symbol(Kind::Module, module.source, module.name.text.as_str()),
                Self::whole(self.path.to_path_buf()),
            ];
            self.add(module.name.span, symbols, true);
            for constant in &module.consts {
                let name = &constant.name;
                self.declares(Kind::Constant, name, name.text.as_str());
            }
            for id in &module.types {
                self.type_declaration(library, *id);
            }
            for id in &module.interfaces {
                let interface = library.interface(*id);
                let name = &interface.name;
                self.declares(Kind::Interface, name, name.text.as_str());
                for operation in &interface.operations {
                    let path = format!("{}.{}", name.text, operation.name.text);
                    self.declares(Kind::Operation, &operation.name, path);
                }
            }
        }
    }

    fn type_declaration(&mut self, library: &Library, id: TypeId) {
        let declared = library.ty(id);
        let owner = &declared.name;
        self.declares(Kind::Type, owner, owner.text.as_str());
        let size = match (&declared.kind, declared.image) {
            (TypeDeclKind::Exception(_), _) => None,
            (_, Some(image)) if image.counted => Some(format!(
                "Plain: at most {} bytes in memory, aligned to {}.",
                image.size, image.align
            )),
            (_, Some(image)) => Some(format!(
                "Plain: {} bytes in memory, aligned to {}.",
                image.size, image.align
            )),
            (TypeDeclKind::Enum(_), None) => Some("Plain: an int32 on the wire.".to_owned()),
            (_, None) => Some("Not plain: its values determine its size.".to_owned()),
        };
        if let Some(size) = size {
            self.names.sizes.insert(owner.text.clone(), size);
        }
        let hint = match (&declared.kind, declared.image) {
            (TypeDeclKind::Struct(_) | TypeDeclKind::Alias(_), Some(image)) => {
                Some(format!("{} bytes", image.size))
            }
            (TypeDeclKind::Enum(_), _) => Some("int32".to_owned()),
            _ => None,
        };
        if let Some(hint) = hint {
            self.hint(owner.span, hint);
        }
        let member = |of: &mut Self, name: &Name| {
            of.declares(Kind::Member, name, format!("{}.{}", owner.text, name.text));
        };
        match &declared.kind {
            TypeDeclKind::Enum(all) => {
                for one in all {
                    member(self, &one.name);
                    self.hint(one.name.span, format!("= {}", one.value));
                }
            }
            TypeDeclKind::Struct(all) | TypeDeclKind::Exception(all) => {
                for one in all {
                    // An exception has the members of its base, which are declared there.
                    member(self, &one.name);
                    self.enumerator(library, one);
                    if let Some(wire) = on_the_wire(library, &one.ty) {
                        self.hint(one.name.span, wire);
                    }
                }
            }
            TypeDeclKind::Alias(_) => {}
        }
    }

    /// The default of a member may name an enumerator.
    fn enumerator(&mut self, library: &Library, member: &Member) {
        let rc_idsl::model::Type::Named(id) = library.resolved(&member.ty) else {
            return;
        };
        let (TypeDeclKind::Enum(all), Some(value)) = (&library.ty(*id).kind, &member.default)
        else {
            return;
        };
        let rc_syntax::LiteralKind::Name(written) = &value.kind else {
            return;
        };
        if let Some(one) = all.iter().find(|one| one.name.text == *written) {
            let owner = &library.ty(*id).name.text;
            let name = format!("{owner}.{}", one.name.text);
            let symbol = self.symbol(Kind::Member, one.name.span.source, name);
            self.refers(value.span, symbol);
        }
    }
}

/// The type of a member on the wire, where the text names another one.
fn on_the_wire(library: &Library, ty: &rc_idsl::model::Type) -> Option<String> {
    use rc_idsl::model::Type;
    let Type::Named(id) = ty else { return None };
    match (library.resolved(ty), &library.ty(*id).kind) {
        (Type::Named(inner), _) => match library.ty(*inner).kind {
            TypeDeclKind::Enum(_) => Some("int32".to_owned()),
            TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => None,
        },
        (resolved, TypeDeclKind::Alias(_)) => Some(shown(library, resolved)),
        _ => None,
    }
}

/// A type as IDSL is written: `sequence<float32, 16>`.
fn shown(library: &Library, ty: &rc_idsl::model::Type) -> String {
    let described = ty.rename(|id| library.type_path(*id)).to_string();
    described.replace(',', ", ")
}
