//! A loop of 1 kHz over printed C: no cycle allocates. `cargo xtask soak kinematics` runs a million of them.

use crate::load_beside;
use crate::printed::compiled;
use std::process::Command;

const SIX: &str = include_str!("../../examples/six.urdf");

const TEXT: &str = "import \"six.urdf\";
Kinematics six
{
    solver fk { pose tool in base; jacobian tool in base; };
    solver hold { efforts; mass_matrix; };
    solver drive { accelerations; };
    solver reach { inverse pose tool in base; within limits; };
    solver push { inverse velocity tool in base; within limits; period 1 ms; };
};";

/// Each cycle has other positions, and calls all solvers. Prints the allocations, then for each solver the median and the
/// greatest time in ns.
const PROGRAM: &str = "#define _POSIX_C_SOURCE 200112L
#include \"six.h\"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static long allocations;
void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_malloc(size_t size) { allocations++; return __real_malloc(size); }
void *__real_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size) { allocations++; return __real_calloc(count, size); }

static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return 1e9 * (double)t.tv_sec + (double)t.tv_nsec; }
static int less(const void *a, const void *b) { float x = *(const float *)a, y = *(const float *)b; return (x > y) - (x < y); }

int main(int count, char **words)
{
    const long cycles = count > 1 ? atol(words[1]) : 1;
    float *times[5];
    for (int at = 0; at < 5; at++) times[at] = malloc((size_t)cycles * sizeof(float));
    if (!times[4]) return 1;
    const long before = allocations;
    struct timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    double last[6] = {0}, sum = 0;
    for (long cycle = 0; cycle < cycles; cycle++)
    {
        double q[6], v[6];
        for (int at = 0; at < 6; at++) { q[at] = sin(0.001 * (double)cycle * (1 + 0.1 * at) + at); v[at] = 0.1 * q[at]; }
        six_fk_result moved; six_hold_result held; six_drive_result driven; six_reach_result reached; six_push_result pushed;
        double t[6];
        t[0] = now(); six_fk(q, &moved);
        t[1] = now(); six_hold(q, v, v, &held);
        t[2] = now(); six_drive(q, v, held.efforts, &driven);
        t[3] = now(); six_reach(moved.pose_tool_in_base, last, &reached);
        t[4] = now(); six_push(q, v, &pushed);
        t[5] = now();
        for (int at = 0; at < 6; at++) last[at] = reached.positions[at];
        for (int at = 0; at < 5; at++) times[at][cycle] = (float)(t[at + 1] - t[at]);
        sum += driven.accelerations[0] + pushed.velocities[0] + (reached.reached ? 0 : 1);
        next.tv_nsec += 1000000;
        if (next.tv_nsec >= 1000000000) { next.tv_nsec -= 1000000000; next.tv_sec++; }
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, 0);
    }
    const long after = allocations;
    printf(\"%ld\\n\", after - before + (sum == 0.123));
    for (int at = 0; at < 5; at++)
    {
        qsort(times[at], (size_t)cycles, sizeof(float), less);
        printf(\"%.0f\\n%.0f\\n\", (double)times[at][cycles / 2], (double)times[at][cycles - 1]);
    }
    return 0;
}
";

#[test]
fn no_cycle_allocates() {
    let cycles = std::env::var("KINEMATICS_CYCLES").unwrap_or_else(|_| "200".to_owned());
    let (cell, found) = load_beside(TEXT, &[("six.urdf", SIX)]);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("six.h"), rc_kinematics::c(&cell)).expect("a file");
    std::fs::write(at("main.c"), PROGRAM).expect("a file");
    let options = [
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-Wl,--wrap=malloc",
        "-Wl,--wrap=calloc",
    ];
    compiled("cc", &options, &at("main.c"), &at("main"));
    let output = Command::new(at("main")).arg(&cycles).output();
    let output = output.expect("it starts");
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("a text");
    let numbers: Vec<f64> = text.lines().filter_map(|line| line.parse().ok()).collect();
    assert_eq!(numbers.len(), 11, "{text}");
    assert_eq!(numbers[0], 0.0, "allocations");
    println!("{cycles} cycles of 1 ms without allocation");
    for (name, times) in ["fk", "hold", "drive", "reach", "push"]
        .iter()
        .zip(numbers[1..].chunks(2))
    {
        assert!(times[0] > 0.0 && times[0] <= times[1], "{name}: {times:?}");
        println!(
            "{name}: {} ns at the median, {} ns at worst",
            times[0], times[1]
        );
    }
}
