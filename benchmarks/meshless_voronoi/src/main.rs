// Volumes of the Voronoi cells of points in the unit cube by meshless_voronoi, for cells_peers.py:
// reads rows of three doubles from a file, writes the volumes, prints seconds on its one thread.
use std::time::Instant;

use glam::DVec3;
use meshless_voronoi::integrals::VolumeIntegral;
use meshless_voronoi::{Dimensionality, VoronoiIntegrator};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&arguments[1]).expect("usage: meshless-time POINTS VOLUMES");
    let numbers: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let points: Vec<DVec3> = numbers
        .chunks_exact(3)
        .map(|p| DVec3::new(p[0], p[1], p[2]))
        .collect();
    let start = Instant::now();
    let cells = VoronoiIntegrator::build(
        &points,
        None,
        DVec3::ZERO,
        DVec3::ONE,
        Dimensionality::ThreeD,
        false,
    );
    let volumes = cells.compute_cell_integrals::<VolumeIntegral>();
    let seconds = start.elapsed().as_secs_f64();
    let bytes: Vec<u8> = volumes.iter().flat_map(|v| v.volume.to_le_bytes()).collect();
    std::fs::write(&arguments[2], bytes).expect("a file for the volumes");
    println!("{seconds:.6}");
}
