//! How different two pictures look.

use super::Picture;

/// Side of the blocks whose mean colours are compared, pixels: coding noise averages out in them.
const BLOCK: usize = 4;
/// Side of the windows, in blocks.
const WINDOW: usize = 4;
/// Weights of red, green and blue in what the eye sees of a difference, summing to one.
const WEIGHTS: [f64; 3] = [0.3, 0.5, 0.2];

/// How different the most different spot of two pictures looks: 0 for the same picture, 1 for
/// black against white anywhere, and 1 where the sizes differ.
///
/// Both pictures are averaged over blocks of 4 x 4 pixels; the answer is the largest
/// root-mean-square difference of these means (channels weighted 0.3, 0.5, 0.2, full scale 1) over
/// any window of 4 x 4 blocks. A mean over the whole picture, such as that of SSIM, would drown one
/// missing mark in a picture of millions of pixels; the worst window does not depend on the
/// picture's size. Coding a photograph anew as JPEG of quality 80 or better stays under 0.03; a
/// ring or a label that is missing or has moved lies above 0.06.
pub fn perceptual_difference(a: &Picture, b: &Picture) -> f64 {
    if (a.width(), a.height()) != (b.width(), b.height()) {
        return 1.0;
    }
    if a.rgba() == b.rgba() {
        return 0.0;
    }
    let squares = Squares::between(a, b);
    let mut worst: f64 = 0.0;
    let (across, down) = (squares.columns.min(WINDOW), squares.rows.min(WINDOW));
    for row in 0..=squares.rows - down {
        for column in 0..=squares.columns - across {
            let sum: f64 = (row..row + down)
                .flat_map(|r| {
                    let start = r * squares.columns + column;
                    &squares.values[start..start + across]
                })
                .sum();
            worst = worst.max(sum);
        }
    }
    let blocks = u32::try_from(across * down).unwrap_or(1);
    (worst / f64::from(blocks)).sqrt()
}

/// The weighted square of the difference of each block's mean colour, full scale 1.
struct Squares {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

impl Squares {
    fn between(a: &Picture, b: &Picture) -> Self {
        let (width, height) = (a.width() as usize, a.height() as usize);
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let mut values = Vec::with_capacity(columns * rows);
        let mut sums = vec![[0i32; 3]; columns];
        for row in 0..rows {
            sums.fill([0; 3]);
            let lines = row * BLOCK..((row + 1) * BLOCK).min(height);
            for y in lines.clone() {
                let line = y * width * 4..(y + 1) * width * 4;
                let pixels_a = a.rgba()[line.clone()].chunks_exact(4);
                let pixels_b = b.rgba()[line].chunks_exact(4);
                for (x, (pa, pb)) in pixels_a.zip(pixels_b).enumerate() {
                    for (sum, (&va, &vb)) in sums[x / BLOCK].iter_mut().zip(pa.iter().zip(pb)) {
                        *sum += i32::from(va) - i32::from(vb);
                    }
                }
            }
            for (column, sum) in sums.iter().enumerate() {
                let across = ((column + 1) * BLOCK).min(width) - column * BLOCK;
                let count = u32::try_from(across * lines.len()).unwrap_or(1);
                let scale = 255.0 * f64::from(count);
                let square = WEIGHTS
                    .iter()
                    .zip(sum)
                    .map(|(weight, &s)| weight * (f64::from(s) / scale).powi(2))
                    .sum();
                values.push(square);
            }
        }
        Self {
            columns,
            rows,
            values,
        }
    }
}
