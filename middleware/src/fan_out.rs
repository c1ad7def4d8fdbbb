//! A publisher over several middlewares: its subscribers are in its process, on its host, on other
//! hosts.

use crate::backend::{LoanedSample, Publisher};
use crate::error::SendError;
use crate::header::{Encoding, Header};

/// One publisher in place of these; one alone is itself.
pub fn over(mut ports: Vec<Box<dyn Publisher>>) -> Box<dyn Publisher> {
    match ports.len() {
        1 => ports.remove(0),
        _ => Box::new(FanOut(ports)),
    }
}

/// Sends each sample over all middlewares. One that fails does not keep the sample from the others.
struct FanOut(Vec<Box<dyn Publisher>>);

/// Sends to publishers. The first error counts.
fn send<'p>(
    ports: impl Iterator<Item = &'p mut Box<dyn Publisher>>,
    header: Header,
    body: &[u8],
) -> Result<(), SendError> {
    let sent = ports.map(|port| port.publish(header, body));
    sent.fold(Ok(()), Result::and)
}

impl FanOut {
    /// The number of the publisher whose memory a sample is written into. The last one: that of the
    /// own process, where readers find the sample in place.
    fn lender(&self) -> Option<usize> {
        let with = |encoding| self.0.iter().rposition(|port| port.can_loan(encoding));
        with(Encoding::Image).or_else(|| with(Encoding::Cdr))
    }
}

impl Publisher for FanOut {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        send(self.0.iter_mut(), header, body)
    }

    /// Images go over all middlewares or over none: one that does not lend memory for them does not
    /// carry them.
    fn can_loan(&self, encoding: Encoding) -> bool {
        let mut ports = self.0.iter();
        match encoding {
            Encoding::Image => ports.all(|port| port.can_loan(encoding)),
            Encoding::Cdr => ports.any(|port| port.can_loan(encoding)),
        }
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let Some(at) = self.lender() else {
            let reason = format!("no middleware lends memory; {length} bytes were wanted");
            return Err(SendError::Backend {
                address: String::new(),
                reason,
            });
        };
        let (before, from) = self.0.split_at_mut(at);
        let (lender, behind) = from.split_at_mut(1);
        let own = lender[0].loan(length)?;
        Ok(Box::new(Lent {
            own,
            others: [before, behind],
        }))
    }

    fn senders(&self) -> Vec<u128> {
        self.0.iter().flat_map(|port| port.senders()).collect()
    }

    fn peers(&self) -> usize {
        self.0.iter().map(|port| port.peers()).sum()
    }
}

/// Memory of one middleware, which the others copy.
struct Lent<'a> {
    own: Box<dyn LoanedSample + 'a>,
    others: [&'a mut [Box<dyn Publisher>]; 2],
}

impl LoanedSample for Lent<'_> {
    fn memory(&self) -> &[u8] {
        self.own.memory()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        self.own.memory_mut()
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let Self { own, others } = *self;
        let others = others.into_iter().flatten();
        let copied = send(others, header, own.memory());
        own.send(header).and(copied)
    }
}
