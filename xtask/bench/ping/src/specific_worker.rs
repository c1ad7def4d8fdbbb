//! Runs one block a period, by commands on its standard input. A block is longer than the period; the
//! reported overrun is harmless here.

use ping_generated::{Context, Point, Worker, WorkerError};

use bench_protocol::{
    Kind, LARGEST, LARGEST_IN_PLACE, keep_pace, next_command, now, pause, ready, report,
};

pub struct SpecificWorker {
    data: Vec<u8>,
    points: Vec<Point>,
    times: Vec<i64>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        ready()?;
        Ok(Self {
            data: vec![7; LARGEST_IN_PLACE],
            points: vec![
                Point {
                    x: 1000.0,
                    y: 2000.0,
                    z: 500.0
                };
                LARGEST / size_of::<Point>()
            ],
            times: Vec::new(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let Some(command) = next_command()? else {
            ctx.stop("no more orders");
            return Ok(());
        };
        self.times.clear();
        let data = &self.data[..command.size];
        let begin = now();
        for number in 0..command.count {
            match command.kind {
                Kind::Publish => {
                    pause(command.size);
                    ctx.sample.sample(now(), data)?;
                }
                Kind::Cloud => {
                    let points = &self.points[..command.size / size_of::<Point>()];
                    pause(command.size);
                    ctx.clouds.cloud(now(), points)?;
                }
                Kind::InPlace => {
                    pause(command.size);
                    let sent = now();
                    let mut picture = ctx.pictures.loan_picture()?;
                    picture.sent = sent;
                    picture.resize_data(data.len())?.copy_from_slice(data);
                    picture.send()?;
                }
                Kind::Lent => {
                    let mut picture = ctx.pictures.loan_picture()?;
                    picture.resize_data(data.len())?.copy_from_slice(data);
                    // Whatever the size, the receiver has slept as long.
                    pause(command.size);
                    picture.sent = now();
                    picture.send()?;
                }
                Kind::Flood => ctx.sample.sample(now(), data)?,
                Kind::Steady => {
                    keep_pace(begin, number);
                    ctx.sample.sample(now(), data)?;
                }
                Kind::Query | Kind::Rested | Kind::Awake => {
                    if command.kind == Kind::Rested {
                        pause(command.size);
                    }
                    let start = now();
                    let answer = match command.kind {
                        Kind::Awake => ctx.awake.echo(data)?,
                        _ => ctx.echo.echo(data)?,
                    };
                    self.times.push(now() - start);
                    if answer.len() != data.len() {
                        return Err(WorkerError::Fatal("another echo".to_owned()));
                    }
                }
            }
        }
        if command.kind == Kind::Flood {
            self.times.push(now() - begin);
        }
        if !command.kind.is_query() {
            pause(command.size);
            ctx.sample.sample(0, &[])?;
        }
        report(&self.times)?;
        Ok(())
    }
}
