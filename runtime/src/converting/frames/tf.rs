//! Where frames are, by slots that receive transforms of tf.
//!
//! The event loop puts each sample of such a slot into its history ([`Fed`]). While it waits inside a
//! conversion, it takes no samples, so the conversion has a subscriber of its own.

use super::transforms::{History, MOST_FRAMES, Missing, Pose, lookup};
use super::{LONGEST_SLEEP, NoTransform};
use crate::clock::Clock;
use rc_conversion::{Needed, Transform};
use rc_middleware::{
    DecodeError, Encoding, Header, KeptSample, Message, QueueGauge, Reader, ReceiveError,
    Subscriber, WakeEvent,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::cell::RefCell;
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The history of a slot, which its subscribers share.
pub(crate) type Shared = Rc<RefCell<History>>;

/// The most samples that are taken at once.
const MOST_AT_ONCE: usize = 4096;
/// The most transforms that are taken at once. Those that come later wait for the next message.
const MOST_TRANSFORMS: usize = 4 * MOST_FRAMES;

/// A slot that receives transforms.
pub(crate) struct TfSlot {
    pub(crate) history: Shared,
    /// For the samples that come during a conversion.
    pub(crate) port: Box<dyn Subscriber>,
    pub(crate) type_hash: u64,
}

/// Knows where frames are by these slots.
pub(crate) struct Tf(pub(crate) Vec<TfSlot>);

/// A new history. `is_constant`: its transforms hold for all times.
pub(crate) fn history(is_constant: bool) -> Shared {
    let mut history = History::default();
    history.is_constant = is_constant;
    Rc::new(RefCell::new(history))
}

impl Tf {
    /// The transform at a time. If a transform of this time may still come, waits for it, at most
    /// until the deadline or the stop.
    pub(super) fn transform(
        &mut self,
        needed: &Needed<'_>,
        clock: &dyn Clock,
        until: Option<(Instant, &WakeEvent)>,
    ) -> Result<Transform, NoTransform> {
        loop {
            for slot in &mut self.0 {
                slot.drain(clock);
            }
            let borrowed: Vec<_> = self.0.iter().map(|slot| slot.history.borrow()).collect();
            let histories: Vec<&History> = borrowed.iter().map(|history| &**history).collect();
            let found = lookup(&histories, (&needed.from, needed.to), needed.time);
            drop(borrowed);
            let now = Instant::now();
            match (found, until) {
                (Ok(transform), _) => return Ok(transform),
                (Err(Missing::Newer(..)), Some((deadline, stop)))
                    if now < deadline && !stop.is_stopping() && self.is_fed() =>
                {
                    self.sleep(deadline - now);
                }
                (Err(missing), _) => return Err(NoTransform::Tf(missing)),
            }
        }
    }

    /// Whether somebody publishes transforms that change.
    fn is_fed(&self) -> bool {
        let mut moving = self
            .0
            .iter()
            .filter(|slot| !slot.history.borrow().is_constant);
        moving.any(|slot| slot.port.peers() > 0)
    }

    /// Sleeps until a sample comes, at most this long.
    fn sleep(&mut self, limit: Duration) {
        let mut all: Vec<PollFd<'_>> = Vec::with_capacity(self.0.len());
        for slot in &self.0 {
            all.push(PollFd::from_borrowed_fd(
                slot.port.descriptor(),
                PollFlags::IN,
            ));
        }
        let limit = Timespec::try_from(limit.min(LONGEST_SLEEP)).ok();
        // A signal ends the sleep, as a sample does.
        let _ = poll(&mut all, limit.as_ref());
        let woken: Vec<bool> = all.iter().map(|fd| !fd.revents().is_empty()).collect();
        drop(all);
        for (slot, woken) in self.0.iter_mut().zip(woken) {
            slot.port.acknowledge(woken);
        }
    }
}

impl TfSlot {
    /// Takes the samples that are there.
    fn drain(&mut self, clock: &dyn Clock) {
        let mut count = 0;
        for _ in 0..MOST_AT_ONCE {
            let (history, hash) = (&self.history, self.type_hash);
            let taken = self.port.receive(&mut |header, body| {
                count += put(history, (hash, clock), header, body);
            });
            // The event loop reports the faults of the slot.
            if taken != Ok(true) || count >= MOST_TRANSFORMS {
                return;
            }
        }
    }
}

/// Puts the transforms of a sample into a history, and returns their number. The handler of the
/// slot reports an invalid sample.
fn put(history: &Shared, (hash, clock): (u64, &dyn Clock), header: Header, body: &[u8]) -> usize {
    let mut count = 0;
    if header.encoding == Encoding::Cdr && (header.type_hash == 0 || header.type_hash == hash) {
        let now = i64::try_from(clock.now().as_nanos()).unwrap_or(i64::MAX);
        let mut history = history.borrow_mut();
        let mut reader = Reader::new(body);
        // A history has no more frames, so a sample of more is hostile or wrong.
        let most = reader.length().unwrap_or(0).min(MOST_FRAMES);
        while count < most && read(&mut history, &mut reader, now).is_ok() {
            count += 1;
        }
    }
    count
}

/// Reads a transform into a history.
fn read(history: &mut History, reader: &mut Reader<'_>, now: i64) -> Result<(), DecodeError> {
    let (seconds, nanoseconds): (i32, u32) = (reader.get()?, reader.get()?);
    let (parent, child): (String, String) = (reader.get()?, reader.get()?);
    let (place, turn): ([f64; 3], [f64; 4]) = (reader.get()?, reader.get()?);
    let time = i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds);
    if let Some(pose) = Pose::new(place, turn) {
        history.put((&parent, &child), (time, now), pose);
    }
    Ok(())
}

/// A subscriber of a slot that receives transforms. Its handler gets the same samples.
pub(crate) struct Fed {
    pub(crate) port: Box<dyn Subscriber>,
    pub(crate) history: Shared,
    pub(crate) type_hash: u64,
    /// The clock of the network.
    pub(crate) clock: Arc<dyn Clock>,
}

impl Subscriber for Fed {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.port.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let (history, of) = (&self.history, (self.type_hash, &*self.clock));
        self.port.receive(&mut |header, body| {
            put(history, of, header, body);
            take(header, body);
        })
    }

    fn receive_message(
        &mut self,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<bool, ReceiveError> {
        // The bytes are needed.
        self.receive(&mut |header, body| take(header, Message::Bytes(body)))
    }

    fn can_keep(&self) -> bool {
        false
    }

    fn receive_kept(
        &mut self,
        _: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        Ok(false)
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::SystemClock;
    use rc_middleware::{Writer, cdr};
    use std::collections::VecDeque;
    use std::io::{Read, Write};
    use std::os::fd::AsFd;
    use std::os::unix::net::UnixStream;
    use std::sync::Mutex;
    use std::thread;

    type Queue = Arc<Mutex<VecDeque<Vec<u8>>>>;

    /// A subscriber whose samples another thread sends, with so many publishers.
    struct Late(UnixStream, Queue, usize);

    impl Subscriber for Late {
        fn descriptor(&self) -> BorrowedFd<'_> {
            self.0.as_fd()
        }

        fn acknowledge(&mut self, woken: bool) {
            if woken {
                let _ = self.0.read(&mut [0; 64]);
            }
        }

        fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
            let sample = self.1.lock().expect("the queue").pop_front();
            if let Some(sample) = &sample {
                take(Header::default(), sample);
            }
            Ok(sample.is_some())
        }

        fn peers(&self) -> usize {
            self.2
        }
    }

    /// A sample that says where `lidar` is in `map` at a second: so many metres ahead.
    fn sample(second: i32, ahead: f64) -> Vec<u8> {
        let mut writer = Writer::default();
        writer.put(&1_u32);
        writer.put(&second);
        writer.put(&0_u32);
        cdr::text("map", &mut writer);
        cdr::text("lidar", &mut writer);
        writer.put(&[ahead, 0.0, 0.0]);
        writer.put(&[0.0, 0.0, 0.0, 1.0]);
        writer.into_bytes()
    }

    fn ahead(found: Result<Transform, NoTransform>) -> f64 {
        found.unwrap_or_else(|reason| panic!("{reason}"))[3]
    }

    #[test]
    fn a_message_waits_for_the_next_transform() {
        let (here, mut there) = UnixStream::pair().expect("a pair");
        let queue = Queue::default();
        let mut tf = Tf(vec![TfSlot {
            history: history(false),
            port: Box::new(Late(here, Arc::clone(&queue), 1)),
            type_hash: 5,
        }]);
        let needed = |time: i64| Needed {
            from: "lidar".to_owned(),
            to: "map",
            time: time * 1_000_000_000,
        };
        let stop = WakeEvent::new().expect("an event");
        let within = |limit: Duration| Some((Instant::now() + limit, &stop));
        let deadline = || within(Duration::from_secs(10));
        // Nothing waits for a frame without a name.
        let unknown = tf
            .transform(&needed(1), &SystemClock, deadline())
            .expect_err("no transform");
        assert!(
            matches!(&unknown, NoTransform::Tf(Missing::Unknown(_))),
            "{unknown}"
        );
        queue.lock().expect("the queue").push_back(sample(1, 1.0));
        assert_eq!(
            ahead(tf.transform(&needed(1), &SystemClock, None)).to_bits(),
            1_f64.to_bits()
        );
        let newer = tf
            .transform(&needed(2), &SystemClock, None)
            .expect_err("no transform");
        assert!(
            matches!(&newer, NoTransform::Tf(Missing::Newer(_, 1_000_000_000))),
            "{newer}"
        );
        let sender = thread::spawn(move || {
            queue.lock().expect("the queue").push_back(sample(3, 3.0));
            there.write_all(&[1]).expect("to wake");
            there
        });
        assert_eq!(
            ahead(tf.transform(&needed(2), &SystemClock, deadline())).to_bits(),
            2_f64.to_bits()
        );
        sender.join().expect("the sender");
        let soon = within(Duration::from_millis(5));
        let late = tf
            .transform(&needed(4), &SystemClock, soon)
            .expect_err("no transform");
        assert!(
            matches!(&late, NoTransform::Tf(Missing::Newer(..))),
            "{late}"
        );
    }

    /// If nothing is published, or the component stops, a message must not wait.
    #[test]
    fn no_message_waits_in_vain() {
        let (here, _there) = UnixStream::pair().expect("a pair");
        let queue: Queue = Arc::new(Mutex::new([sample(1, 1.0)].into()));
        let tf = |publishers: usize| {
            let here = here.try_clone().expect("a descriptor");
            Tf(vec![TfSlot {
                history: history(false),
                port: Box::new(Late(
                    here,
                    Arc::new(Mutex::new(queue.lock().expect("the queue").clone())),
                    publishers,
                )),
                type_hash: 5,
            }])
        };
        let needed = Needed {
            from: "lidar".to_owned(),
            to: "map",
            time: 2_000_000_000,
        };
        let (running, stopping) = (
            WakeEvent::new().expect("an event"),
            WakeEvent::new().expect("an event"),
        );
        stopping.stop();
        let limit = Duration::from_mins(10);
        for (publishers, stop) in [(0, &running), (1, &stopping)] {
            let until = Some((Instant::now() + limit, stop));
            let missing = tf(publishers).transform(&needed, &SystemClock, until);
            let missing = missing.expect_err("no transform");
            assert!(
                matches!(&missing, NoTransform::Tf(Missing::Newer(..))),
                "{missing}"
            );
        }
    }

    /// A sample is read as far as a history could hold it.
    #[test]
    fn a_sample_of_too_many_frames_is_read_in_part() {
        let mut writer = Writer::default();
        writer.put(&20_000_u32);
        for frame in 0..20_000 {
            writer.put(&1_i32);
            writer.put(&0_u32);
            cdr::text("map", &mut writer);
            cdr::text(&format!("f{frame}"), &mut writer);
            writer.put(&[0.0; 3]);
            writer.put(&[0.0, 0.0, 0.0, 1.0]);
        }
        let of = history(true);
        let body = writer.into_bytes();
        let count = put(&of, (5, &SystemClock), Header::default(), &body);
        assert_eq!(count, MOST_FRAMES);
        let found = |frame: &str| lookup(&[&of.borrow()], (frame, "map"), 0).is_ok();
        assert!(found("f0") && found(&format!("f{}", MOST_FRAMES - 1)));
        assert!(!found(&format!("f{MOST_FRAMES}")));
    }

    #[test]
    fn a_slot_hands_on_what_it_learns() {
        let (here, _there) = UnixStream::pair().expect("a pair");
        let samples = [sample(1, 1.0), sample(2, 2.0)];
        let broken = samples[1][..30].to_vec();
        let queue: Queue = Arc::new(Mutex::new([samples[0].clone(), broken].into()));
        let own = history(true);
        let mut fed = Fed {
            port: Box::new(Late(here, queue, 1)),
            history: Rc::clone(&own),
            type_hash: 5,
            clock: Arc::new(SystemClock),
        };
        let mut seen = 0;
        while fed.receive(&mut |_, _| seen += 1) == Ok(true) {}
        assert_eq!(seen, 2);
        let found = lookup(&[&own.borrow()], ("map", "lidar"), 77);
        assert_eq!(
            found.map(|found| found[3].to_bits()),
            Ok((-1_f64).to_bits())
        );
    }
}
