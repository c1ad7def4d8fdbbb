//! Messages that chains follow through programs outside of the network, and where their stamps are.
//!
//! Messages are encoded as in DDS and ROS 2 (XCDR1). What precedes the stamp must be skipped without
//! its type: numbers, texts, and sequences and arrays of numbers.

use super::check::ChainCheck;
use super::flow::nanoseconds;
use super::{OutsideLink, Port};
use rc_cdsl::model::Role;
use rc_ddsl::model::{Chain, ChainPoint};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::model::{Library, Member, Operation, Type, TypeDeclKind};
use rc_vocabulary::{Primitive, Skip, Stamp, StampOf};

impl ChainCheck<'_> {
    /// What programs outside of the network do for a chain. `None` if that is wrong.
    pub(super) fn outside(
        &self,
        chain: &Chain,
        found: &mut Diagnostics,
    ) -> Option<Vec<OutsideLink>> {
        let links = chain.outside.iter().map(|declared| {
            let ends = [
                (&declared.from, Role::Publishes),
                (&declared.to, Role::SubscribesTo),
            ];
            let ends = ends.map(|(point, role)| {
                let port = self.port(point, found)?;
                Some((port, self.stamp(point, port, role, found)?))
            });
            let [Some((from, sent)), Some((to, received))] = ends else {
                return None;
            };
            Some(OutsideLink {
                from,
                to,
                within: nanoseconds(declared.within),
                stamps: [sent, received],
            })
        });
        let links: Vec<Option<OutsideLink>> = links.collect();
        links.into_iter().collect()
    }

    /// Where the stamp of a message to or from outside is.
    fn stamp(
        &self,
        point: &ChainPoint,
        port: Port,
        role: Role,
        found: &mut Diagnostics,
    ) -> Option<Stamp> {
        let name = self.network.port_name(port);
        let mut report = |message: String, help: &str| {
            found.push(Diagnostic::error("bad-chain", point.span, message).help(help));
            None
        };
        let component = &self.network.projects[port.instance].as_deref()?.component;
        let slot = &component.slots[port.slot];
        if slot.role != role {
            let (is_not, help) = match role {
                Role::Publishes => (
                    "is not published",
                    "name a topic left of `->` that the component publishes",
                ),
                _ => (
                    "is not subscribed to",
                    "name a topic right of `->` that the component subscribes to",
                ),
            };
            return report(format!("`{name}` {is_not}"), help);
        }
        let own = &self.network.deployment.instances[port.instance];
        let middleware = slot.backend.unwrap_or(own.middleware);
        if !middleware.can().joins_machines {
            let help =
                "programs outside copy stamps over `dds` and `ros2`: use one of them for this slot";
            return report(format!("`{name}` is on `{}`", middleware.word()), help);
        }
        let operation = &component.library.interface(slot.interface).operations[port.operation];
        match place_of(&component.library, operation) {
            Ok(stamp) => Some(stamp),
            Err(why) => report(
                format!("`{name}` cannot be followed through programs outside: {why}"),
                "mark the time that they copy with `@stamp`, before everything whose length is not known",
            ),
        }
    }
}

/// The place of the stamp of an operation. The error says why there is none.
fn place_of(library: &Library, operation: &Operation) -> Result<Stamp, String> {
    let mut place = Place {
        library,
        before: Vec::new(),
    };
    match place.find(&operation.inputs)? {
        Some(of) => Ok(Stamp {
            before: place.before,
            of,
        }),
        None => Err("no member of it is marked with `@stamp`".to_owned()),
    }
}

struct Place<'l> {
    library: &'l Library,
    before: Vec<Skip>,
}

impl Place<'_> {
    /// Looks for the first stamp, and notes what is before it.
    fn find(&mut self, members: &[Member]) -> Result<Option<StampOf>, String> {
        for member in members {
            if member.stamp && !member.optional {
                return self.stamp(member).map(Some);
            }
            if member.optional {
                let inner = self.library.resolved(&member.ty).clone();
                self.skip_all(&member.name.text, &inner)?;
            } else if let Some(found) = self.inside(member)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    fn inside(&mut self, member: &Member) -> Result<Option<StampOf>, String> {
        let name = &member.name.text;
        match self.library.resolved(&member.ty).clone() {
            Type::Primitive(primitive) => self.skip(primitive.size(), 1, false),
            Type::Text { .. } => self.skip(1, 1, true),
            Type::Sequence { element, .. } => self.skip_all(name, &element)?,
            Type::Array { element, length } => {
                let size = self.size_of_one(name, &element)?;
                self.skip(size, length, false);
            }
            Type::Dictionary { .. } => return Err(cannot_skip(name)),
            Type::Named(id) => match &self.library.ty(id).kind {
                TypeDeclKind::Enum(_) => self.skip(4, 1, false),
                TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                    let members = members.clone();
                    return self.find(&members);
                }
                TypeDeclKind::Alias(_) => return Err(cannot_skip(name)),
            },
        }
        Ok(None)
    }

    /// Skips any number of elements.
    fn skip_all(&mut self, name: &str, element: &Type) -> Result<(), String> {
        let size = self.size_of_one(name, element)?;
        self.skip(size, 1, true);
        Ok(())
    }

    /// The bytes of an element of a sequence or an array.
    fn size_of_one(&self, name: &str, element: &Type) -> Result<usize, String> {
        self.size(element).ok_or_else(|| {
            if self.holds_stamp(element) {
                format!("each element of `{name}` has a stamp of its own, and a message needs one")
            } else {
                cannot_skip(name)
            }
        })
    }

    /// Whether a member of a structure, or of one in it, is a stamp.
    fn holds_stamp(&self, ty: &Type) -> bool {
        match self.library.resolved(ty) {
            Type::Sequence { element, .. } | Type::Array { element, .. } => {
                self.holds_stamp(element)
            }
            Type::Named(id) => match &self.library.ty(*id).kind {
                TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                    let mut members = members.iter();
                    members.any(|member| member.stamp || self.holds_stamp(&member.ty))
                }
                _ => false,
            },
            _ => false,
        }
    }

    fn skip(&mut self, size: usize, count: u32, counted: bool) {
        self.before.push(Skip {
            size: size as u8,
            count,
            counted,
        });
    }

    /// The bytes of a number, an enum or a `bool`.
    fn size(&self, ty: &Type) -> Option<usize> {
        match self.library.resolved(ty) {
            Type::Primitive(primitive) => Some(primitive.size()),
            Type::Named(id) => {
                matches!(self.library.ty(*id).kind, TypeDeclKind::Enum(_)).then_some(4)
            }
            _ => None,
        }
    }

    fn stamp(&self, member: &Member) -> Result<StampOf, String> {
        let whole = |ty: &Type| match self.library.resolved(ty) {
            Type::Primitive(primitive) => Some(*primitive),
            _ => None,
        };
        let of = match self.library.resolved(&member.ty) {
            Type::Primitive(Primitive::I64 | Primitive::U64) => Some(StampOf::Nanoseconds),
            Type::Named(id) => match &self.library.ty(*id).kind {
                TypeDeclKind::Struct(members) => match members.as_slice() {
                    [seconds, nanoseconds] => match (whole(&seconds.ty), whole(&nanoseconds.ty)) {
                        (
                            Some(Primitive::I32 | Primitive::U32),
                            Some(Primitive::I32 | Primitive::U32),
                        ) => Some(StampOf::Seconds),
                        _ => None,
                    },
                    _ => None,
                },
                _ => None,
            },
            _ => None,
        };
        of.ok_or_else(|| {
            format!(
                "its stamp `{}` is not a `long`, a `uint64`, or a struct of seconds and nanoseconds of 32 bits each",
                member.name.text
            )
        })
    }
}

fn cannot_skip(name: &str) -> String {
    format!("its stamp stands behind `{name}`, whose length is not known without its elements")
}
