//! The code by which slots convert. Only the description of a component with a slot that calls or
//! receives names it, so the program of any other one is linked without it.

use super::Connections;
use crate::converting::{Conversions, ConvertingClient, ConvertingSubscriber};
use crate::slots::OpenSlot;
use rc_conversion::Plan;
use rc_middleware::{Client, Endpoint, OpenError, Subscriber};
use std::fmt;

/// The code by which slots convert.
pub struct Converter {
    /// Returns the error in the text of a plan.
    pub(crate) check: fn(&str) -> Result<(), String>,
    client:
        fn(&Connections, &OpenSlot, usize, Box<dyn Client>) -> Result<Box<dyn Client>, OpenError>,
    /// The slot, its subscribers, each with its endpoint, and the index of the slot.
    subscribers: fn(&Connections, &OpenSlot, usize, Subscribers) -> Result<Subscribers, OpenError>,
}

/// The subscribers of a slot, by operations.
pub(super) type Subscribers = Vec<(Endpoint, Box<dyn Subscriber>)>;

/// The code by which slots convert, for the description of a component with slots that call or
/// receive.
pub static CONVERTER: Converter = Converter {
    check: |text| {
        let plan = text.parse::<Plan>();
        plan.map(drop).map_err(|error| error.to_string())
    },
    client,
    subscribers,
};

impl fmt::Debug for Converter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Converter")
    }
}

impl Connections {
    /// A client of a slot, which converts if the slot does.
    pub(super) fn converting_client(
        &self,
        open: &OpenSlot,
        at: usize,
        port: Box<dyn Client>,
    ) -> Result<Box<dyn Client>, OpenError> {
        match self.converter() {
            Some(converter) => (converter.client)(self, open, at, port),
            None => Ok(port),
        }
    }

    /// The subscribers of a slot, which convert if the slot does, and from whose samples conversions
    /// of other slots learn where frames are.
    pub(super) fn converting_subscribers(
        &self,
        open: &OpenSlot,
        at: usize,
        ports: Subscribers,
    ) -> Result<Subscribers, OpenError> {
        match self.converter() {
            Some(converter) => (converter.subscribers)(self, open, at, ports),
            None => Ok(ports),
        }
    }

    /// The code, if a slot converts.
    fn converter(&self) -> Option<&'static Converter> {
        let Conversions { plans, trees, .. } = &self.conversions;
        let converts = !plans.is_empty() || !trees.is_empty();
        self.description.converter.filter(|_| converts)
    }

    /// The plan of a slot, if it converts.
    pub(super) fn plan(&self, slot: &str) -> Result<Option<Plan>, OpenError> {
        let text = self.conversions.plans.get(slot);
        let plan = text.map(|text| text.parse::<Plan>()).transpose();
        plan.map_err(|error| OpenError::Backend {
            address: slot.to_owned(),
            reason: error.to_string(),
        })
    }
}

fn client(
    connections: &Connections,
    open: &OpenSlot,
    at: usize,
    port: Box<dyn Client>,
) -> Result<Box<dyn Client>, OpenError> {
    Ok(match connections.plan(&open.name)? {
        Some(plan) => {
            let counts = connections.conversion(at);
            ConvertingClient::over(&plan, open.slot.operations, &counts, port)
        }
        None => port,
    })
}

fn subscribers(
    connections: &Connections,
    open: &OpenSlot,
    at: usize,
    ports: Subscribers,
) -> Result<Subscribers, OpenError> {
    let plan = connections.plan(&open.name)?;
    let plan = plan.map(|plan| (plan, connections.conversion(at)));
    let ports = ports.into_iter().enumerate();
    let ports = ports.map(|(operation, (endpoint, port))| {
        let port = match &plan {
            Some((plan, counts)) => {
                let of = &open.operations[operation];
                let address = endpoint.address.to_string();
                let frames = || connections.frames(&open.name);
                ConvertingSubscriber::over((plan, operation, of), address, counts, frames, port)?
            }
            None => port,
        };
        Ok((endpoint, connections.fed((open, operation), port)))
    });
    ports.collect()
}
