//! The macros with which generated code declares the types of a schema.

/// Declares the world of a component, one version of it, and a change of it, which generated code gives
/// functions of the types.
#[macro_export]
macro_rules! world {
    () => {
        pub use $crate::{Overruled, Sample, dsr};

        /// The world that the component shares with others.
        pub struct World(pub(crate) $crate::Member);

        impl World {
            /// The present version. It never changes, and reading it takes no lock.
            pub fn snapshot(&self) -> View {
                View($crate::View(self.0.snapshot()))
            }

            /// A version with the change that a token names, and all earlier ones of its writer: what is
            /// asked of it knows what another component has just done. It waits until the change is
            /// there, as `wait_for` does.
            ///
            /// # Errors
            /// The change does not arrive within `limit` of the system's time.
            pub fn snapshot_after(
                &mut self,
                token: $crate::Token,
                limit: ::core::time::Duration,
            ) -> ::core::result::Result<View, $crate::Error> {
                if self.0.wait_for(token, limit) {
                    ::core::result::Result::Ok(self.snapshot())
                } else {
                    ::core::result::Result::Err($crate::Error::Behind(token))
                }
            }

            /// Makes several changes, which others see as one. The token names them.
            ///
            /// # Errors
            /// The closure fails, the schema does not allow the change, or the component may not
            /// write an element. Nothing has changed then.
            pub fn change(
                &mut self,
                make: impl ::core::ops::FnOnce(
                    &mut Edit<'_>,
                ) -> ::core::result::Result<(), $crate::Error>,
            ) -> ::core::result::Result<$crate::Token, $crate::Error> {
                $crate::change(&mut self.0, |edit| make(&mut Edit(edit)))
            }

            /// The coordinates in `to` of a point with these coordinates in `from`, at `time` of the
            /// network's clock. Between two changes of a pose, it is interpolated.
            ///
            /// # Errors
            /// A name does not denote exactly one node, no edges with poses connect the nodes, the
            /// history begins later, or the newest change is older than `time`.
            pub fn transform(
                &self,
                to: impl $crate::End,
                point: $crate::Point,
                from: impl $crate::End,
                time: $crate::Time,
            ) -> ::core::result::Result<$crate::Point, $crate::Error> {
                ::core::result::Result::Ok(self.between(to, from, time)?.point(&point))
            }

            /// The transform that takes coordinates in `from` to those in `to`, at `time` of the network's
            /// clock.
            ///
            /// # Errors
            /// Those of `transform`.
            pub fn between(
                &self,
                to: impl $crate::End,
                from: impl $crate::End,
                time: $crate::Time,
            ) -> ::core::result::Result<$crate::Transform, $crate::Error> {
                $crate::between(&self.0, to, from, time)
            }
        }

        impl ::core::ops::Deref for World {
            type Target = $crate::Member;

            fn deref(&self) -> &$crate::Member {
                &self.0
            }
        }

        impl ::core::ops::DerefMut for World {
            fn deref_mut(&mut self) -> &mut $crate::Member {
                &mut self.0
            }
        }

        /// One version of the world, which never changes.
        #[derive(Clone, Debug)]
        pub struct View(pub $crate::View);

        impl ::core::ops::Deref for View {
            type Target = $crate::View;

            fn deref(&self) -> &$crate::View {
                &self.0
            }
        }

        /// A change of the world. It dereferences to the change of a graph without types.
        #[derive(Debug)]
        pub struct Edit<'e>(pub &'e mut $crate::Edit);

        impl ::core::ops::Deref for Edit<'_> {
            type Target = $crate::Edit;

            fn deref(&self) -> &$crate::Edit {
                self.0
            }
        }

        impl ::core::ops::DerefMut for Edit<'_> {
            fn deref_mut(&mut self) -> &mut $crate::Edit {
                self.0
            }
        }
    };
}

/// Declares a type of nodes.
#[macro_export]
macro_rules! node {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $crate::element!($(#[$doc])* $name, $kind, NodeRef);

        impl $crate::End for $name<'_> {
            fn node(
                self,
                _: &$crate::Snapshot,
            ) -> ::core::result::Result<$crate::NodeId, $crate::Error> {
                ::core::result::Result::Ok(self.0.node_id())
            }
        }

        impl $crate::Kind for $name<'static> {
            const NAME: &'static str = $kind;
            type In<'s> = $name<'s>;

            fn of(
                snapshot: &$crate::Snapshot,
                element: $crate::Element,
            ) -> ::core::option::Option<$name<'_>> {
                let $crate::Element::Node(node) = element else {
                    return ::core::option::Option::None;
                };
                let node = snapshot.node(node).ok()?;
                snapshot.schema().is_a(node.type_name(), $kind).then_some($name(node))
            }

            fn all(
                snapshot: &$crate::Snapshot,
            ) -> ::std::boxed::Box<dyn ::core::iter::Iterator<Item = $name<'_>> + '_> {
                let nodes = snapshot.instances($kind);
                ::std::boxed::Box::new(nodes.filter_map(|node| snapshot.node(node).ok().map($name)))
            }
        }
    };
}

/// Declares a type of edges.
#[macro_export]
macro_rules! edge {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $crate::element!($(#[$doc])* $name, $kind, EdgeRef);

        impl $crate::Kind for $name<'static> {
            const NAME: &'static str = $kind;
            type In<'s> = $name<'s>;

            fn of(
                snapshot: &$crate::Snapshot,
                element: $crate::Element,
            ) -> ::core::option::Option<$name<'_>> {
                let $crate::Element::Edge(edge) = element else {
                    return ::core::option::Option::None;
                };
                let edge = snapshot.edge(edge).ok()?;
                (edge.type_name() == $kind).then_some($name(edge))
            }

            fn all(
                snapshot: &$crate::Snapshot,
            ) -> ::std::boxed::Box<dyn ::core::iter::Iterator<Item = $name<'_>> + '_> {
                let edges = snapshot.edges();
                ::std::boxed::Box::new(
                    edges.filter(|edge| edge.type_name() == $kind).map($name),
                )
            }
        }
    };
}

/// Declares the structure of a type of nodes or edges.
#[doc(hidden)]
#[macro_export]
macro_rules! element {
    ($(#[$doc:meta])* $name:ident, $kind:literal, $of:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name<'s>(pub $crate::$of<'s>);

        impl<'s> ::core::ops::Deref for $name<'s> {
            type Target = $crate::$of<'s>;

            fn deref(&self) -> &$crate::$of<'s> {
                &self.0
            }
        }
    };
}

/// Declares the changes that a component may make to nodes or edges of a type.
#[macro_export]
macro_rules! edit_element {
    ($(#[$doc:meta])* $name:ident, $id:ident) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name<'e> {
            edit: &'e mut $crate::Edit,
            id: $crate::$id,
        }

        impl $name<'_> {
            /// Names the element in all versions.
            pub fn id(&self) -> $crate::$id {
                self.id
            }

            /// Sets an attribute to a number in a unit, which is converted into that of the schema:
            /// `set_in("width", 80.0, "cm")`.
            ///
            /// # Errors
            /// The attribute has no unit, or one of another kind.
            pub fn set_in(
                &mut self,
                attribute: &str,
                value: f64,
                unit: &str,
            ) -> ::core::result::Result<(), $crate::Error> {
                $crate::set_in(self.edit, self.id.into(), attribute, value, unit)
            }
        }
    };
}

/// Declares functions that read the attributes of a type.
#[macro_export]
macro_rules! reads {
    ($life:lifetime $name:ident; $($(#[$doc:meta])* $get:ident: $ty:ty = $read:expr, $attribute:literal;)*) => {
        impl<$life> $name<$life> {
            $(
                $(#[$doc])*
                pub fn $get(&self) -> ::core::option::Option<$ty> {
                    ($read)(self.0.get($attribute)?)
                }
            )*
        }
    };
}

/// Declares functions that set the attributes of a type which a component writes.
#[macro_export]
macro_rules! writes {
    ($name:ident; $($(#[$doc:meta])* $set:ident: $ty:ty = $attribute:literal $(, $write:path)?;)*) => {
        impl $name<'_> {
            $(
                $(#[$doc])*
                ///
                /// # Errors
                /// The value is none that the graph holds.
                pub fn $set(&mut self, value: $ty) -> ::core::result::Result<(), $crate::Error> {
                    let value = $crate::given!(value $(, $write)?);
                    ::core::result::Result::Ok(self.edit.set(self.id, $attribute, value)?)
                }
            )*
        }
    };
}

/// A value as a graph takes it.
#[doc(hidden)]
#[macro_export]
macro_rules! given {
    ($value:ident) => {
        $value
    };
    ($value:ident, $write:path) => {
        $write($value)
    };
}

/// Declares how a view finds the node of a type that has a name.
#[macro_export]
macro_rules! node_by_name {
    ($name:ident, $kind:literal, $function:ident) => {
        impl View {
            #[doc = concat!("The `", $kind, "` with this name.")]
            ///
            /// # Errors
            /// There is none, or there are several.
            pub fn $function(
                &self,
                name: &str,
            ) -> ::core::result::Result<$name<'_>, $crate::Error> {
                self.0.one::<$name<'static>>(name)
            }
        }
    };
}

/// Declares how a view finds the edge of a type between two nodes.
#[macro_export]
macro_rules! edge_between {
    ($name:ident, $kind:literal, $function:ident, $from:ident, $to:ident) => {
        impl View {
            #[doc = concat!("The edge `", $kind, "` between two nodes, if there is one.")]
            ///
            /// # Errors
            /// A name does not denote exactly one node.
            pub fn $function(
                &self,
                $from: impl $crate::End,
                $to: impl $crate::End,
            ) -> ::core::result::Result<::core::option::Option<$name<'_>>, $crate::Error> {
                self.0.between_nodes::<$name<'static>>($from, $to)
            }
        }
    };
}

/// Declares how a change finds the node of a type that has a name.
#[macro_export]
macro_rules! edit_node_by_name {
    ($name:ident, $kind:literal, $function:ident) => {
        impl Edit<'_> {
            #[doc = concat!("The `", $kind, "` with this name.")]
            ///
            /// # Errors
            /// There is none, or there are several.
            pub fn $function(
                &mut self,
                name: &str,
            ) -> ::core::result::Result<$name<'_>, $crate::Error> {
                let id = $crate::existing(self.0, $kind, name)?;
                ::core::result::Result::Ok($name { edit: self.0, id })
            }
        }
    };
}

/// Declares how a change adds a node of a type, with a name if the type has one.
#[macro_export]
macro_rules! add_node {
    ($name:ident, $kind:literal, $function:ident $(, $text:ident)?) => {
        impl Edit<'_> {
            #[doc = concat!("Adds a `", $kind, "`.")]
            ///
            /// # Errors
            /// The graph has no place for it.
            pub fn $function(
                &mut self
                $(, $text: &str)?
            ) -> ::core::result::Result<$name<'_>, $crate::Error> {
                let name: ::core::option::Option<&str> =
                    [$($text)?].into_iter().next();
                let id = $crate::added(self.0, $kind, name)?;
                ::core::result::Result::Ok($name { edit: self.0, id })
            }
        }
    };
}

/// Declares how a change finds the edge of a type between two nodes. `edge` adds it if there is
/// none, `existing_edge` does not.
#[macro_export]
macro_rules! edit_edge {
    (edge, $name:ident, $kind:literal, $function:ident, $from:ident, $to:ident) => {
        $crate::edit_edge!(
            #[doc = concat!("The edge `", $kind, "` between two nodes, which is added if there is none. In a tree, the child loses its parent then.")]
            "the schema does not allow the edge", edge, $name, $kind, $function, $from, $to
        );
    };
    (existing_edge, $name:ident, $kind:literal, $function:ident, $from:ident, $to:ident) => {
        $crate::edit_edge!(
            #[doc = concat!("The edge `", $kind, "` between two nodes.")]
            "there is no such edge", existing_edge, $name, $kind, $function, $from, $to
        );
    };
    (#[$doc:meta] $error:literal, $how:ident, $name:ident, $kind:literal, $function:ident, $from:ident, $to:ident) => {
        impl Edit<'_> {
            #[$doc]
            ///
            /// # Errors
            #[doc = concat!("A name does not denote exactly one node, or ", $error, ".")]
            pub fn $function(
                &mut self,
                $from: impl $crate::End,
                $to: impl $crate::End,
            ) -> ::core::result::Result<$name<'_>, $crate::Error> {
                let id = $crate::$how(self.0, $kind, $from, $to)?;
                ::core::result::Result::Ok($name { edit: self.0, id })
            }
        }
    };
}

/// Declares that a component removes nodes or edges of a type.
#[macro_export]
macro_rules! removes {
    ($name:ident, $how:ident) => {
        impl $name<'_> {
            /// Removes it.
            ///
            /// # Errors
            /// It was removed before.
            pub fn remove(self) -> ::core::result::Result<(), $crate::Error> {
                ::core::result::Result::Ok(self.edit.$how(self.id)?)
            }
        }
    };
}
