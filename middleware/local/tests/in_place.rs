//! Samples in place: three subscribers read each where it was written, and memory is used again.

use rc_conformance::network::{LIMIT, Network, endpoint};
use rc_middleware::in_place::{self, FromBytes, Immutable, InPlace, IntoBytes, KnownLayout};
use rc_middleware::typed::{Operation, TypedPublisher};
use rc_middleware::{Backend, DecodeError, EncodeError, Environment, OpenError, Reader, wait};
use std::collections::BTreeSet;
use std::sync::mpsc::channel;
use std::thread;

struct Local;

impl rc_conformance::Subject for Local {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        rc_local::connect(environment)
    }
}

/// `struct Image { sequence<octet, 1048576> pixels; }`
#[derive(FromBytes, Immutable, IntoBytes, KnownLayout)]
#[zerocopy(crate = "rc_middleware::in_place::zerocopy")]
#[repr(C)]
struct Image {
    length: u32,
    pixels: [u8; 1 << 20],
}

impl InPlace for Image {
    type Value = Vec<u8>;

    const NAME: &'static str = "Image";

    fn reset(&mut self) {
        self.length = 0;
    }

    fn set(&mut self, value: &Vec<u8>) -> Result<(), EncodeError> {
        in_place::resize(
            "Image.pixels",
            &mut self.pixels,
            &mut self.length,
            value.len(),
        )?
        .copy_from_slice(value);
        Ok(())
    }

    fn value(&self) -> Result<Vec<u8>, DecodeError> {
        Ok(in_place::filled(&self.pixels, self.length).to_vec())
    }
}

const IMAGE: Operation = Operation {
    name: "image",
    id: 1,
    type_hash: 7,
    two_way: false,
    replies: &[],
};
const SAMPLES: u8 = 200;

/// Where an image lies, and its first byte.
fn place(image: &Image) -> (usize, u8) {
    (image.pixels.as_ptr().addr(), image.pixels[0])
}

#[test]
fn an_image_is_read_where_it_was_written() {
    let network = Network::new(&Local);
    let address = endpoint("default/Camera/image");
    let (tell, told) = channel();
    thread::scope(|scope| {
        let (open, opened) = channel();
        for number in 0..3 {
            let (tell, open) = (tell.clone(), open.clone());
            let (network, address) = (&network, &address);
            scope.spawn(move || {
                let backend = network.join_bare(&format!("reader{number}"));
                let mut subscriber = backend.subscriber(address).expect("a subscriber");
                open.send(()).expect("a writer");
                for _ in 0..SAMPLES {
                    let mut read = None;
                    while read.is_none() {
                        let woken = wait(&[subscriber.descriptor()], LIMIT) != 0;
                        assert!(woken, "no image came");
                        subscriber.acknowledge(woken);
                        let received = subscriber.receive(&mut |header, body| {
                            let mut reader = Reader::of(body, header.encoding);
                            read = Some(place(&reader.in_place::<Image>().expect("an image")));
                        });
                        received.expect("to receive");
                    }
                    tell.send(read).expect("a writer");
                }
            });
        }
        let backend = network.join_bare("writer");
        let port = backend.publisher(&address).expect("a publisher");
        let mut topic = TypedPublisher::new(port, IMAGE);
        for _ in 0..3 {
            opened.recv().expect("a reader");
        }
        let mut places = BTreeSet::new();
        for number in 0..SAMPLES {
            let mut image = topic.loan::<Image>().expect("a loan");
            image.pixels[0] = number;
            let written = place(&image);
            places.insert(written.0);
            image.send().expect("to be sent");
            for _ in 0..3 {
                assert_eq!(told.recv_timeout(LIMIT), Ok(Some(written)));
            }
        }
        // A sample's memory takes another one once nobody reads it: the last reader may still be
        // about to drop it when the next sample begins.
        assert!(places.len() <= 3, "{} allocations", places.len());
    });
}

/// Three subscribers read one image: nobody allocates memory for it, nor copies it.
#[test]
fn an_image_for_three_subscribers_takes_no_new_memory() {
    let network = Network::new(&Local);
    let address = endpoint("default/Camera/image");
    let backend = network.join_bare("both");
    let port = backend.publisher(&address).expect("a publisher");
    let mut topic = TypedPublisher::new(port, IMAGE);
    let mut subscribers: Vec<_> = (0..3)
        .map(|_| backend.subscriber(&address).expect("a subscriber"))
        .collect();
    let mut exchange = || {
        let mut image = topic.loan::<Image>().expect("a loan");
        image.pixels[0] = 7;
        let written = place(&image);
        image.send().expect("to be sent");
        for subscriber in &mut subscribers {
            let mut read = None;
            let received = subscriber.receive(&mut |header, body| {
                let mut reader = Reader::of(body, header.encoding);
                read = Some(place(&reader.in_place::<Image>().expect("an image")));
            });
            received.expect("to receive");
            assert_eq!(read, Some(written));
        }
        written
    };
    // Queues have their room, and the publisher its memory, after the first image.
    let first = exchange();
    let used = allocation_counter::measure(|| assert_eq!(exchange(), first));
    // The sender that lends the memory, and its reader.
    assert!(used.bytes_total < 1024, "{used:?}");
}
