// Delaunay triangulation of points in the plane by delaunator, for cells_peers.py: reads rows of
// two doubles from a file, prints seconds of time on its one thread and the number of triangles.
use std::time::Instant;

use delaunator::{triangulate, Point};

fn main() {
    let path = std::env::args().nth(1).expect("usage: delaunator-time POINTS");
    let bytes = std::fs::read(path).expect("a file of points");
    let numbers: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let points: Vec<Point> = numbers
        .chunks_exact(2)
        .map(|p| Point { x: p[0], y: p[1] })
        .collect();
    let start = Instant::now();
    let triangulation = triangulate(&points);
    let seconds = start.elapsed().as_secs_f64();
    println!("{seconds:.6} {}", triangulation.triangles.len() / 3);
}
