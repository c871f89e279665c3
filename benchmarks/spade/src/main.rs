// Delaunay triangulation of points in the plane by spade, for cells_peers.py: reads rows of two
// doubles from a file, prints seconds of time on its one thread and the number of triangles.
use std::time::Instant;

use spade::{DelaunayTriangulation, Point2, Triangulation};

fn main() {
    let path = std::env::args().nth(1).expect("usage: spade-time POINTS");
    let bytes = std::fs::read(path).expect("a file of points");
    let numbers: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let points: Vec<Point2<f64>> = numbers
        .chunks_exact(2)
        .map(|p| Point2::new(p[0], p[1]))
        .collect();
    let start = Instant::now();
    let triangulation =
        DelaunayTriangulation::<Point2<f64>>::bulk_load(points).expect("a triangulation");
    let seconds = start.elapsed().as_secs_f64();
    println!("{seconds:.6} {}", triangulation.num_inner_faces());
}
