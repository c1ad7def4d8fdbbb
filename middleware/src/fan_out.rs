//! A publisher over several middlewares: its subscribers are in its process, on its host, on other
//! hosts.

use crate::backend::{ImageEncoder, LoanedSample, Publisher};
use crate::counter::Counter;
use crate::error::SendError;
use crate::header::{Encoding, Header};
use crate::shared_value::SharedValue;

/// One publisher in place of these; one alone is itself. Each counter counts what goes over its
/// middleware, if there are several.
pub fn over(mut ports: Vec<(Box<dyn Publisher>, Counter)>) -> Box<dyn Publisher> {
    if ports.len() == 1 {
        return ports.remove(0).0;
    }
    let ports = ports.into_iter().map(|(port, sent)| Port { port, sent });
    Box::new(FanOut(ports.collect()))
}

/// Sends each sample over all middlewares. One that fails does not keep the sample from the others.
struct FanOut(Vec<Port>);

struct Port {
    port: Box<dyn Publisher>,
    sent: Counter,
}

/// Counts a sample that was sent.
fn counted(sent: Result<(), SendError>, counter: &Counter) -> Result<(), SendError> {
    if sent.is_ok() {
        counter.next();
    }
    sent
}

/// Sends to publishers. The first error counts.
fn send<'p>(
    ports: impl Iterator<Item = &'p mut Port>,
    header: Header,
    body: &[u8],
) -> Result<(), SendError> {
    let sent = ports.map(|of| counted(of.port.publish(header, body), &of.sent));
    sent.fold(Ok(()), Result::and)
}

/// Sends an image to publishers. A middleware that lends no memory for images does not transport
/// them.
fn send_image<'p>(
    ports: impl Iterator<Item = &'p mut Port>,
    header: Header,
    image: &[u8],
    encode: ImageEncoder<'_>,
) -> Result<(), SendError> {
    let (like, unlike): (Vec<_>, Vec<_>) = ports.partition(|of| of.port.can_loan(Encoding::Image));
    let sent = send(like.into_iter(), header, image);
    if unlike.is_empty() {
        return sent;
    }
    let header = Header {
        encoding: Encoding::Cdr,
        ..header
    };
    let encoded = encode(image).map_err(SendError::from);
    sent.and(encoded.and_then(|body| send(unlike.into_iter(), header, &body)))
}

impl FanOut {
    /// The number of the publisher whose memory a sample is written into. The last one: that of the
    /// own process, where readers find the sample in place.
    fn lender(&self) -> Option<usize> {
        let with = |encoding| self.0.iter().rposition(|of| of.port.can_loan(encoding));
        with(Encoding::Image).or_else(|| with(Encoding::Cdr))
    }
}

impl Publisher for FanOut {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        send(self.0.iter_mut(), header, body)
    }

    fn takes_values(&self) -> bool {
        self.0.iter().any(|of| of.port.takes_values())
    }

    /// All share one encoding. The last one, that of the own process, gets the value itself: its
    /// last receiver takes it without a clone.
    fn publish_value(&mut self, header: Header, body: SharedValue) -> Result<(), SendError> {
        let Some((last, others)) = self.0.split_last_mut() else {
            return Ok(());
        };
        let sent = others.iter_mut().map(|of| {
            let sent = of.port.publish_value(header, body.clone());
            counted(sent, &of.sent)
        });
        let sent = sent.fold(Ok(()), Result::and);
        sent.and(counted(last.port.publish_value(header, body), &last.sent))
    }

    fn can_loan(&self, encoding: Encoding) -> bool {
        self.0.iter().any(|of| of.port.can_loan(encoding))
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
        let Port { port, sent } = &mut lender[0];
        Ok(Box::new(Lent {
            own: port.loan(length)?,
            sent,
            others: [before, behind],
        }))
    }

    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        match self.lender() {
            Some(at) => self.0[at].port.loan_image(length),
            None => Ok(None),
        }
    }

    fn send_lent(
        &mut self,
        loan: Box<dyn LoanedSample>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        let lender = self.lender();
        let others = self.0.iter_mut().enumerate();
        let others = others.filter(|(at, _)| Some(*at) != lender);
        let others = others.map(|(_, of)| of);
        let copied = send_image(others, header, loan.memory(), encode);
        let Some(Port { port, sent }) = lender.map(|at| &mut self.0[at]) else {
            return loan.send_image(header, encode).and(copied);
        };
        counted(port.send_lent(loan, header, encode), sent).and(copied)
    }

    fn senders(&self) -> Vec<u128> {
        self.0.iter().flat_map(|of| of.port.senders()).collect()
    }

    fn peers(&self) -> usize {
        self.0.iter().map(|of| of.port.peers()).sum()
    }
}

/// Memory of one middleware, which the others copy.
struct Lent<'a> {
    own: Box<dyn LoanedSample + 'a>,
    sent: &'a Counter,
    others: [&'a mut [Port]; 2],
}

impl LoanedSample for Lent<'_> {
    fn memory(&self) -> &[u8] {
        self.own.memory()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        self.own.memory_mut()
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let Self { own, sent, others } = *self;
        let others = others.into_iter().flatten();
        let copied = send(others, header, own.memory());
        counted(own.send(header), sent).and(copied)
    }

    fn send_image(
        self: Box<Self>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        let Self { own, sent, others } = *self;
        let others = others.into_iter().flatten();
        let copied = send_image(others, header, own.memory(), encode);
        counted(own.send_image(header, encode), sent).and(copied)
    }
}
