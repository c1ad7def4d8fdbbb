//! Function that makes a component, which generated code hands over.

use crate::context::Core;
use crate::error::StartError;
use crate::ports::Ports;
use rc_configuration::Values;

/// Creates the component: its publishers and clients, its context, its worker.
pub trait Start<C>: FnOnce(Core, &Ports, &Values) -> Result<C, StartError> {}

impl<C, F: FnOnce(Core, &Ports, &Values) -> Result<C, StartError>> Start<C> for F {}
