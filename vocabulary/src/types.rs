//! Types where they are used.

use crate::{Layout, Primitive};
use serde::{Serialize, Serializer};
use std::fmt;
use std::sync::Arc;

/// A type where it is used: of a member, a parameter, an element.
///
/// `N` represents a type with a name: the name in a text, an index into a library, or the
/// declaration itself.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type<N> {
    /// A number or a `bool`.
    Primitive(Primitive),
    /// Text in UTF-8.
    Text {
        /// The largest number of bytes.
        bound: Option<u32>,
    },
    /// Any number of elements.
    Sequence {
        /// Their type.
        element: Arc<Self>,
        /// The largest number of elements.
        bound: Option<u32>,
    },
    /// A fixed number of elements.
    Array {
        /// Their type.
        element: Arc<Self>,
        /// Their number.
        length: u32,
    },
    /// Pairs of key and value.
    Dictionary {
        /// The type of keys.
        key: Arc<Self>,
        /// The type of values.
        value: Arc<Self>,
    },
    /// A type with a name.
    Named(N),
}

impl<N> Type<N> {
    /// The names in it, with repetitions.
    pub fn names(&self) -> Vec<&N> {
        match self {
            Self::Primitive(_) | Self::Text { .. } => Vec::new(),
            Self::Sequence { element, .. } | Self::Array { element, .. } => element.names(),
            Self::Dictionary { key, value } => {
                let mut names = key.names();
                names.extend(value.names());
                names
            }
            Self::Named(name) => vec![name],
        }
    }

    /// The type with each name replaced by a type.
    ///
    /// # Errors
    /// The first one of `replace`.
    pub fn replace<M, E>(
        &self,
        replace: &mut impl FnMut(&N) -> Result<Type<M>, E>,
    ) -> Result<Type<M>, E> {
        Ok(match self {
            Self::Primitive(primitive) => Type::Primitive(*primitive),
            Self::Text { bound } => Type::Text { bound: *bound },
            Self::Sequence { element, bound } => Type::Sequence {
                element: Arc::new(element.replace(replace)?),
                bound: *bound,
            },
            Self::Array { element, length } => Type::Array {
                element: Arc::new(element.replace(replace)?),
                length: *length,
            },
            Self::Dictionary { key, value } => Type::Dictionary {
                key: Arc::new(key.replace(replace)?),
                value: Arc::new(value.replace(replace)?),
            },
            Self::Named(name) => replace(name)?,
        })
    }

    /// The type with other names.
    pub fn rename<M>(&self, mut rename: impl FnMut(&N) -> M) -> Type<M> {
        let renamed: Result<_, std::convert::Infallible> =
            self.replace(&mut |name| Ok(Type::Named(rename(name))));
        match renamed {
            Ok(renamed) => renamed,
        }
    }

    /// The memory image, if the type determines its size. `image` has those of named types.
    pub fn layout(&self, image: &impl Fn(&N) -> Option<Layout>) -> Option<Layout> {
        Some(match self {
            Self::Primitive(primitive) => Layout::number(primitive.size()),
            Self::Text { bound } => Layout::text((*bound)?),
            Self::Sequence { element, bound } => {
                Layout::sequence(element.layout(image)?, (*bound)?)
            }
            Self::Array { element, length } => element.layout(image)?.times(*length),
            Self::Dictionary { .. } => return None,
            Self::Named(name) => image(name)?,
        })
    }
}

/// A type as an object: its `kind`, and the fields of the kind.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Object<'t, N> {
    Primitive {
        name: Primitive,
    },
    Text {
        bound: Option<u32>,
    },
    Sequence {
        element: &'t Type<N>,
        bound: Option<u32>,
    },
    Array {
        element: &'t Type<N>,
        length: u32,
    },
    Dictionary {
        key: &'t Type<N>,
        value: &'t Type<N>,
    },
    Named(&'t N),
}

impl<N: Serialize> Serialize for Type<N> {
    /// `N` has to be a structure.
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let object = match self {
            Self::Primitive(name) => Object::Primitive { name: *name },
            Self::Text { bound } => Object::Text { bound: *bound },
            Self::Sequence { element, bound } => Object::Sequence {
                element,
                bound: *bound,
            },
            Self::Array { element, length } => Object::Array {
                element,
                length: *length,
            },
            Self::Dictionary { key, value } => Object::Dictionary { key, value },
            Self::Named(name) => Object::Named(name),
        };
        object.serialize(to)
    }
}

impl<N: fmt::Display> fmt::Display for Type<N> {
    /// As in descriptions: `sequence<float32,16>`, `int32[3]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Primitive(primitive) => f.write_str(primitive.word()),
            Self::Text { bound: None } => f.write_str("string"),
            Self::Text { bound: Some(bound) } => write!(f, "string<{bound}>"),
            Self::Sequence {
                element,
                bound: None,
            } => write!(f, "sequence<{element}>"),
            Self::Sequence {
                element,
                bound: Some(bound),
            } => write!(f, "sequence<{element},{bound}>"),
            Self::Array { element, length } => write!(f, "{element}[{length}]"),
            Self::Dictionary { key, value } => write!(f, "dictionary<{key},{value}>"),
            Self::Named(name) => name.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_replaced_everywhere_and_sizes_follow() {
        let named = |name: &'static str| Arc::new(Type::Named(name));
        let points = Type::Sequence {
            element: named("Point"),
            bound: Some(4),
        };
        let places = Type::Dictionary {
            key: Arc::new(Type::Text { bound: Some(8) }),
            value: Arc::new(Type::Array {
                element: Arc::new(points.clone()),
                length: 2,
            }),
        };
        assert_eq!(
            places.to_string(),
            "dictionary<string<8>,sequence<Point,4>[2]>"
        );
        assert_eq!(places.names(), [&"Point"]);
        let renamed = places.rename(|name| format!("Parts::{name}"));
        assert_eq!(
            renamed.to_string(),
            "dictionary<string<8>,sequence<Parts::Point,4>[2]>"
        );
        let replaced =
            points.replace(&mut |_| Ok::<Type<String>, ()>(Type::Primitive(Primitive::F32)));
        assert_eq!(
            replaced.expect("no error").to_string(),
            "sequence<float32,4>"
        );
        assert_eq!(
            places.replace::<String, _>(&mut |name| Err(*name)),
            Err("Point")
        );
        let image = |_: &&str| Some(Layout::number(8));
        assert_eq!(points.layout(&image).map(|layout| layout.size), Some(40));
        assert_eq!(points.layout(&|_| None), None);
        assert_eq!(places.layout(&image), None);
    }
}
