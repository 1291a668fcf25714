//! Cost of hours-long runs: no more at the end than at the beginning.

use boresight::{device::Fault, simulation::kernel::SimKernel};

use crate::cameras::{grey, open, run};

/// Number of cycles between two looks at the memory, and of looks.
const CYCLES: usize = 100;
const LOOKS: usize = 4;

#[test]
fn hundreds_of_replugs_leave_nothing_behind() {
    let kernel = SimKernel::new(vec![grey(0)]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 4.0);
    let mut kept = Vec::new();
    for _ in 0..LOOKS {
        let memory = allocation_counter::measure(|| {
            for _ in 0..CYCLES {
                kernel.world().cameras[0].present = false;
                let now = || kernel.world().now_nanos as f64 / 1e9;
                let gone = run(&mut source, &kernel, now() + 0.5);
                assert_eq!(gone.lost(), [Fault::Unplugged]);
                kernel.world().cameras[0].present = true;
                let back = run(&mut source, &kernel, now() + 3.0);
                assert!(back.returned() && back.takeable > 10, "{:?}", back.events);
            }
        });
        kept.push(memory.bytes_current);
        assert_eq!(kernel.open_devices(), 1);
    }
    println!("after {CYCLES} cycles each, bytes kept: {kept:?}");
    assert!(kept[1..].iter().all(|bytes| bytes.abs() < 64 << 10), "{kept:?}");
    assert_eq!(kernel.world().violations, Vec::<String>::new());
}
