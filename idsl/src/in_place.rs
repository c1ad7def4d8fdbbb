//! Which types have a memory image, and which values can travel in place.

use crate::model::{Layout, Library, Member, Operation, Type, TypeDeclKind, TypeId};

impl Library {
    /// The image of a value of this type. `None` if the type does not determine its size.
    pub fn image(&self, ty: &Type) -> Option<Layout> {
        ty.layout(&|id| self.ty(*id).image)
    }

    /// The image of a member. `None` as for [`image`](Self::image).
    pub fn member_image(&self, member: &Member) -> Option<Layout> {
        let value = self.image(&member.ty)?;
        Some(if member.optional {
            Layout::sequence(value, 1)
        } else {
            value
        })
    }

    /// The struct that `ty` resolves to, if its values can travel in place: a plain struct with a
    /// bounded sequence.
    pub fn in_place(&self, ty: &Type) -> Option<TypeId> {
        let Type::Named(id) = self.resolved(ty) else {
            return None;
        };
        let decl = self.ty(*id);
        let image = decl.image?;
        let fits = matches!(decl.kind, TypeDeclKind::Struct(_)) && image.fits();
        (image.counted && fits).then_some(*id)
    }
}

impl Operation {
    /// The struct of the only parameter, if a topic of this operation can travel in place.
    pub fn topic_in_place(&self, library: &Library) -> Option<TypeId> {
        match self.inputs.as_slice() {
            [only] if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }

    /// The struct of the only result, if the reply can travel in place.
    pub fn result_in_place(&self, library: &Library) -> Option<TypeId> {
        match (&self.result, self.outputs.as_slice()) {
            (Some(result), []) => library.in_place(result),
            (None, [only]) if !only.optional => library.in_place(&only.ty),
            _ => None,
        }
    }
}
