//! The worker with a camera that stands for the simulated one.

use std::cell::Cell;
use std::rc::Rc;
use tracker::SpecificWorker;
use tracker_generated::testing::{HumanCameraBodySample, TestContext};
use tracker_generated::{TDepth, Worker, WorkerError};

/// A picture of a wall.
fn wall(alivetime: i64) -> TDepth {
    TDepth {
        width: 8,
        height: 6,
        focalx: 8,
        focaly: 8,
        alivetime,
        depth_factor: 0.001,
        depth: [3000.0_f32; 48].map(f32::to_le_bytes).concat(),
        ..TDepth::default()
    }
}

#[test]
fn each_picture_is_published_once_also_without_people() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let time = Rc::new(Cell::new(0));
    let now = Rc::clone(&time);
    test.camera_rgbd_simple
        .on_get_depth(move |_| Ok(wall(now.get())));
    let mut worker = SpecificWorker::initialize(&mut test)?;
    for at in [0, 0, 100, 100, 200] {
        time.set(at);
        worker.compute(&mut test)?;
    }
    let samples = test.human_camera_body.samples();
    let times: Vec<_> = samples
        .into_iter()
        .map(|HumanCameraBodySample::NewPeopleData { people }| {
            (people.timestamp, people.peoplelist.len())
        })
        .collect();
    assert_eq!(times, [(0, 0), (100, 0), (200, 0)]);
    Ok(())
}

#[test]
fn a_picture_that_cannot_be_read_is_an_error_and_the_next_one_is_read() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let calls = Rc::new(Cell::new(0));
    let count = Rc::clone(&calls);
    test.camera_rgbd_simple.on_get_depth(move |_| {
        count.set(count.get() + 1);
        let mut image = wall(count.get());
        image.compressed = count.get() == 1;
        Ok(image)
    });
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let refused = worker.compute(&mut test);
    assert!(matches!(refused, Err(WorkerError::Failed(text)) if text.contains("compressed")));
    worker.compute(&mut test)?;
    assert_eq!(test.human_camera_body.samples().len(), 1);
    Ok(())
}
