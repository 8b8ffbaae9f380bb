use std::io::Cursor;

use tiff::decoder::Decoder;
use tiff::tags::Tag;

use super::*;
use crate::frame::{Geodetic, Planet, Site};

/// A mosaic whose colour tells column and row, with an empty corner.
fn mosaic(columns: usize, rows: usize) -> Mosaic {
    let mut rgba = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let empty = column < 40 && row < 40;
            let [r, g] = [column % 256, row % 256].map(|n| u8::try_from(n).unwrap());
            rgba.extend(if empty { [0; 4] } else { [r, g, 7, 255] });
        }
    }
    Mosaic {
        grid: MosaicGrid {
            crs: "EPSG:32719".to_owned(),
            west_m: 500_000.0,
            north_m: 7_000_000.0,
            scale: MosaicScale { m_per_px: 0.05 },
            columns,
            rows,
        },
        rgba,
    }
}

fn site(planet: Planet) -> Site {
    Site::new(planet, Geodetic::from_degrees(-24.45, -69.93, 1000.0))
}

#[test]
fn every_level_of_the_file_decodes_to_its_pixels() {
    let mosaic = mosaic(700, 300);
    let bytes = encode(mosaic.clone(), &site(Planet::EARTH)).unwrap();
    let mut decoder = Decoder::new(Cursor::new(&bytes)).unwrap();
    let mut sizes = Vec::new();
    let mut offsets: Vec<u64> = Vec::new();
    loop {
        let (width, height) = decoder.dimensions().unwrap();
        sizes.push((width, height));
        let begin = decoder.get_tag_u64_vec(Tag::TileOffsets).unwrap();
        offsets.push(begin[0]);
        let tiff::decoder::DecodingResult::U8(samples) = decoder.read_image().unwrap() else {
            panic!("not bytes");
        };
        if sizes.len() == 1 {
            assert_eq!(samples, mosaic.rgba);
            let scale = decoder.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap();
            assert_eq!(scale, [0.05, 0.05, 0.0]);
            let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap();
            assert_eq!(keys[keys.len() - 4..], [3072, 0, 1, 32719]);
        } else {
            assert_eq!(samples[..4], [0; 4], "the empty corner stays empty");
        }
        if !decoder.more_images() {
            break;
        }
        decoder.next_image().unwrap();
    }
    assert_eq!(sizes, [(700, 300), (350, 150), (175, 75)]);
    // The coarsest comes first, so that its reader need not wait for the rest.
    assert!(offsets.is_sorted_by(|a, b| a > b), "{offsets:?}");
}

#[test]
fn another_planet_has_a_projection_of_its_own() {
    let mut mosaic = mosaic(10, 10);
    mosaic.grid.crs = "+proj=tmerc".to_owned();
    let bytes = encode(mosaic, &site(Planet::MARS)).unwrap();
    let mut decoder = Decoder::new(Cursor::new(&bytes)).unwrap();
    let doubles = decoder.get_tag_f64_vec(Tag::GeoDoubleParamsTag).unwrap();
    assert_eq!(
        doubles,
        [3_396_190.0, 3_396_190.0, -69.93, -24.45, 0.0, 0.0, 1.0]
    );
    let text = decoder
        .get_tag_ascii_string(Tag::GeoAsciiParamsTag)
        .unwrap();
    assert!(
        text.starts_with("mars local transverse Mercator|"),
        "{text}"
    );
}
