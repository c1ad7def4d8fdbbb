//! The queries that a schema names, as functions of a view.

use crate::error::Error;
use crate::view::End;
use graph_query::{Budget, Queries as Prepared};
pub use graph_query::{Cell, Rows};
use property_graph::Snapshot;
use std::sync::OnceLock;

/// The queries of the schema of one component. They are read when one is asked for the first time.
#[derive(Debug, Default)]
pub struct Queries(OnceLock<Prepared>);

impl Queries {
    /// Queries that are not read yet.
    pub const fn new() -> Self {
        Self(OnceLock::new())
    }

    /// The rows of a query.
    ///
    /// # Errors
    /// Those of [`graph_query::Queries::run`]. The budget is the one that a query has by default.
    pub fn run<const N: usize>(
        &self,
        version: &Snapshot,
        name: &str,
        parameters: [(&'static str, Cell); N],
    ) -> Result<Rows, Error> {
        let queries = self.0.get_or_init(|| Prepared::of(version.schema()));
        let rows = queries.run(version, name, parameters, Budget::default());
        rows.map_err(|error| Error::Query(error.into()))
    }
}

/// The value of an argument that a query takes as it is.
///
/// # Errors
/// It never fails. Generated code calls it as it calls [`node`].
pub fn plain(_: &Snapshot, argument: impl Into<Cell>) -> Result<Cell, Error> {
    Ok(argument.into())
}

/// The value of bytes.
///
/// # Errors
/// It never fails. Generated code calls it as it calls [`node`].
pub fn bytes(_: &Snapshot, argument: &[u8]) -> Result<Cell, Error> {
    Ok(Cell::Bytes(argument.into()))
}

/// The value of a pose: x, y, z and the angles about x, y, z.
///
/// # Errors
/// It never fails. Generated code calls it as it calls [`node`].
pub fn pose(_: &Snapshot, argument: [f64; 6]) -> Result<Cell, Error> {
    Ok(Cell::List(argument.into_iter().map(Cell::Float).collect()))
}

/// The value of a node, or of the name of one.
///
/// # Errors
/// No node has the name, or several have it.
pub fn node(version: &Snapshot, argument: impl End) -> Result<Cell, Error> {
    argument.node(version).map(Cell::Node)
}

/// Declares the function of a query that the schema names.
#[macro_export]
macro_rules! query {
    ($(#[$doc:meta])* $function:ident, $query:literal; $($argument:ident: $ty:ty = $make:path, $parameter:literal;)*) => {
        impl View {
            $(#[$doc])*
            ///
            /// # Errors
            /// A name does not denote exactly one node, an argument is a node of another entity, or the query
            /// takes more steps or rows than a query may.
            pub fn $function(
                &self,
                $($argument: $ty,)*
            ) -> ::core::result::Result<$crate::query::Rows, $crate::Error> {
                let version = self.0.snapshot();
                QUERIES.run(version, $query, [$(($parameter, $make(version, $argument)?)),*])
            }
        }
    };
}
