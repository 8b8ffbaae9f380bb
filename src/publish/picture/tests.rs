//! Reading, writing, metadata.

mod kinds;

use super::*;
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;

/// A grey ramp with some texture, coloured a little.
fn ramp(width: u32, height: u32) -> Picture {
    Picture::from_fn(width, height, |x, y| {
        let base = x * 180 / width + y * 40 / height;
        [base + 20, base + 10 + x * y % 7, base].map(|v| u8::try_from(v).unwrap())
    })
    .unwrap()
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    image
        .write_to(&mut Cursor::new(&mut bytes), format)
        .unwrap();
    bytes
}

fn rgb_image(picture: &Picture) -> DynamicImage {
    let pixel = |x, y| image::Rgb(picture.colour(x, y).unwrap());
    DynamicImage::ImageRgb8(image::RgbImage::from_fn(
        picture.width(),
        picture.height(),
        pixel,
    ))
}

/// An EXIF segment of one entry, orientation 6 (turned by a quarter).
fn exif_segment() -> Vec<u8> {
    let mut content = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01".to_vec();
    content.extend_from_slice(&[1, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0, 0, 0, 0, 0]);
    segment(0xe1, &content)
}

fn segment(marker: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len() + 2).unwrap().to_be_bytes();
    [&[0xff, marker], length.as_slice(), content].concat()
}

/// The JPEG with segments put in right after its start.
fn with_segments(jpeg: &[u8], segments: &[Vec<u8>]) -> Vec<u8> {
    [&jpeg[..2], &segments.concat(), &jpeg[2..]].concat()
}

#[test]
fn png_keeps_every_pixel() {
    let picture = ramp(61, 37);
    let again = Picture::decode(&picture.to_png().unwrap()).unwrap();
    assert_eq!(again, picture);
}

#[test]
fn jpeg_comes_back_nearly_the_same_and_always_in_the_same_bytes() {
    let picture = ramp(160, 120);
    let jpeg = picture.to_jpeg(90).unwrap();
    assert_eq!(jpeg, picture.to_jpeg(90).unwrap());
    let again = Picture::decode(&jpeg).unwrap();
    let worst = picture.rgba().iter().zip(again.rgba());
    assert!(worst.map(|(a, b)| a.abs_diff(*b)).max().unwrap() < 16);
    assert!(again.rgba().chunks_exact(4).all(|pixel| pixel[3] == 255));
}

#[test]
fn a_thin_coloured_line_keeps_its_colour_in_jpeg() {
    let line = |x: u32, _| {
        if x == 21 {
            [213, 94, 0]
        } else {
            [120, 110, 100]
        }
    };
    let picture = Picture::from_fn(64, 64, line).unwrap();
    let again = Picture::decode(&picture.to_jpeg(90).unwrap()).unwrap();
    let [r, g, b] = again.colour(21, 30).unwrap();
    assert!(
        r.abs_diff(213) < 12 && g.abs_diff(94) < 12 && b < 24,
        "{r} {g} {b}"
    );
}

#[test]
fn sizes_come_from_headers_and_no_orientation_turns_them() {
    let folder = tempfile::tempdir().unwrap();
    let picture = ramp(50, 30);
    let jpeg = with_segments(&picture.to_jpeg(80).unwrap(), &[exif_segment()]);
    let files = [
        ("a.jpg", jpeg),
        ("a.png", picture.to_png().unwrap()),
        ("a.tif", encoded(&rgb_image(&picture), ImageFormat::Tiff)),
    ];
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(Picture::size_of(&path, name).unwrap(), (50, 30));
        let read = Picture::read(&path, name).unwrap();
        assert_eq!((read.width(), read.height()), (50, 30));
    }
}

#[test]
fn exif_xmp_and_the_colour_profile_are_carried_on() {
    let plain = ramp(48, 32).to_jpeg(85).unwrap();
    let kept = [
        exif_segment(),
        segment(0xe1, b"http://ns.adobe.com/xap/1.0/\0<x/>"),
        segment(0xe2, b"ICC_PROFILE\0\x01\x01sixteen of bytesRGB "),
    ];
    let others = [segment(0xe2, b"MPF\0index"), segment(0xfe, b"a comment")];
    let source = with_segments(&plain, &[kept.concat(), others.concat()]);
    let written = Picture::decode(&source).unwrap().to_jpeg(85).unwrap();
    let find = |part: &[u8]| written.windows(part.len()).position(|w| w == part);
    let at: Vec<usize> = kept.iter().map(|segment| find(segment).unwrap()).collect();
    assert!(at.is_sorted());
    // The JFIF header stays the first segment, as its standard asks.
    assert_eq!(&written[2..11], b"\xff\xe0\0\x10JFIF\0");
    assert!(find(b"MPF\0").is_none() && find(b"a comment").is_none());
    let again = Picture::decode(&written).unwrap();
    assert_eq!(again.metadata, Picture::decode(&source).unwrap().metadata);
}

#[test]
fn what_is_not_a_picture_is_told_in_exact_words() {
    let words = |bytes: &[u8]| Picture::decode(bytes).unwrap_err().to_string();
    assert_eq!(
        words(b"image_id,time"),
        "found a file that starts with the bytes 69 6d 61 67, expected a JPEG, PNG or TIFF picture"
    );
    assert_eq!(
        words(b""),
        "found an empty file, expected a JPEG, PNG or TIFF picture"
    );
    let picture = ramp(64, 48);
    let jpeg = picture.to_jpeg(90).unwrap();
    let png = picture.to_png().unwrap();
    let tiff = encoded(&rgb_image(&picture), ImageFormat::Tiff);
    for (bytes, format) in [(jpeg, "JPEG"), (png, "PNG"), (tiff, "TIFF")] {
        for share in [5, 20, 50, 90] {
            assert_eq!(
                words(&bytes[..bytes.len() * share / 100]),
                format!("found a {format} picture that ends early, expected a whole one"),
                "{share} % of the file"
            );
        }
    }
}

#[test]
fn a_damaged_jpeg_is_told_in_exact_words() {
    let mut jpeg = ramp(64, 48).to_jpeg(90).unwrap();
    let tables = jpeg.windows(2).position(|w| w == [0xff, 0xdb]).unwrap();
    jpeg[tables + 4] = 0x0f; // A quantisation table that does not exist.
    assert_eq!(
        Picture::decode(&jpeg).unwrap_err().to_string(),
        "found a JPEG picture that cannot be decoded (Bogus DQT index 15), expected a sound one"
    );
}

#[test]
fn stray_bytes_after_the_scan_are_no_damage() {
    let jpeg = ramp(64, 48).to_jpeg(90).unwrap();
    let end = jpeg.len() - 2;
    let stray = [&jpeg[..end], b"\x11\x22", &jpeg[end..]].concat();
    assert_eq!(
        Picture::decode(&stray).unwrap(),
        Picture::decode(&jpeg).unwrap()
    );
}

#[test]
fn impossible_sizes_are_refused() {
    let error = Picture::of_colour(1 << 20, 1 << 20, [0; 3]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "found 1048576 x 1048576 pixels, expected 1 to 268435456"
    );
    assert!(Picture::of_colour(0, 5, [0; 3]).is_err());
}

#[test]
fn files_are_named_by_their_faults() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("v001.jpg");
    let words = format!("{}: cannot read: no such file or folder", missing.display());
    let error = Picture::read(&missing, "v001.jpg").unwrap_err();
    assert_eq!(error.to_string(), words);
    let error = Picture::size_of(&missing, "v001.jpg").unwrap_err();
    assert_eq!(error.to_string(), words);
    std::fs::write(&missing, "GIF89a").unwrap();
    let expected = "v001.jpg: found a file that starts with the bytes 47 49 46 38, expected a JPEG, PNG or TIFF picture";
    let error = Picture::read(&missing, "v001.jpg").unwrap_err();
    assert_eq!(error.to_string(), expected);
    let error = Picture::size_of(&missing, "v001.jpg").unwrap_err();
    assert_eq!(error.to_string(), expected);
    std::fs::write(&missing, [0xff, 0xd8, 0xff, 0xe0, 0, 16, 1]).unwrap();
    assert_eq!(
        Picture::size_of(&missing, "v001.jpg")
            .unwrap_err()
            .to_string(),
        "v001.jpg: found a JPEG picture that ends early, expected a whole one"
    );
}

#[test]
fn writing_leaves_the_whole_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let picture = ramp(40, 30);
    for name in ["a.JPG", "b.jpeg", "c.png", "d.TIF", "e.tiff"] {
        picture.write(&folder.path().join(name), 90).unwrap();
    }
    let mut names: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["a.JPG", "b.jpeg", "c.png", "d.TIF", "e.tiff"]);
    for name in ["c.png", "d.TIF", "e.tiff"] {
        let again = Picture::read(&folder.path().join(name), name).unwrap();
        assert_eq!(again, picture, "{name}");
    }
    let bitmap = folder.path().join("f.bmp");
    assert_eq!(
        picture.write(&bitmap, 90).unwrap_err().to_string(),
        format!(
            "{}: found extension \"bmp\", expected jpg, jpeg, png, tif or tiff",
            bitmap.display()
        )
    );
    let nowhere = folder.path().join("none/e.png");
    assert_eq!(
        picture.write(&nowhere, 90).unwrap_err().to_string(),
        format!(
            "{}: cannot write: no such file or folder",
            nowhere.display()
        )
    );
}

#[test]
fn the_difference_is_that_of_the_worst_spot() {
    let black = Picture::of_colour(100, 80, [0; 3]).unwrap();
    let white = Picture::of_colour(100, 80, [255; 3]).unwrap();
    assert_eq!(perceptual_difference(&black, &black), 0.0);
    assert!((perceptual_difference(&black, &white) - 1.0).abs() < 1e-12);
    let other_size = Picture::of_colour(80, 100, [0; 3]).unwrap();
    assert_eq!(perceptual_difference(&black, &other_size), 1.0);
    // One block of 4 x 4 pixels in a window of 16 blocks: sqrt(1 / 16).
    let spot = |x: u32, y: u32| [if x / 4 == 9 && y / 4 == 7 { 255 } else { 0 }; 3];
    let spotted = Picture::from_fn(100, 80, spot).unwrap();
    assert!((perceptual_difference(&black, &spotted) - 0.25).abs() < 1e-12);
    assert_eq!(
        perceptual_difference(&black, &spotted),
        perceptual_difference(&spotted, &black)
    );
    // Smaller than a window, and not a multiple of a block.
    let small = |value| Picture::of_colour(3, 5, [value; 3]).unwrap();
    assert!((perceptual_difference(&small(0), &small(51)) - 0.2).abs() < 1e-12);
}

#[test]
fn a_jpeg_copy_has_its_colour_as_finely_as_the_source() {
    use turbojpeg::{Image, PixelFormat};
    let picture = ramp(64, 48);
    let image = |rgba| Image {
        pixels: rgba,
        width: 64,
        pitch: 256,
        height: 48,
        format: PixelFormat::RGBA,
    };
    for (source, copy) in [
        (Subsamp::Sub2x2, Subsamp::Sub2x2),
        (Subsamp::Sub2x1, Subsamp::Sub2x1),
        (Subsamp::Sub1x2, Subsamp::Sub1x2),
        (Subsamp::None, Subsamp::None),
        (Subsamp::Gray, Subsamp::None),
    ] {
        let jpeg = turbojpeg::compress(image(picture.rgba()), 90, source).unwrap();
        let written = Picture::decode(&jpeg).unwrap().to_jpeg(90).unwrap();
        let header = turbojpeg::read_header(&written).unwrap();
        assert_eq!(header.subsamp, copy, "{source:?}");
    }
    let mut compressor = turbojpeg::Compressor::new().unwrap();
    compressor.set_progressive(true).unwrap();
    compressor.set_subsamp(Subsamp::Sub2x2).unwrap();
    let progressive = compressor.compress_to_vec(image(picture.rgba())).unwrap();
    let written = Picture::decode(&progressive).unwrap().to_jpeg(90).unwrap();
    let header = turbojpeg::read_header(&written).unwrap();
    assert_eq!(
        (header.subsamp, header.is_progressive),
        (Subsamp::Sub2x2, false)
    );
}

#[test]
fn exif_goes_from_jpeg_to_png_and_back() {
    let jpeg = ramp(48, 32).to_jpeg(85).unwrap();
    let source = Picture::decode(&with_segments(&jpeg, &[exif_segment()])).unwrap();
    let png = source.to_png().unwrap();
    assert!(png.windows(4).any(|w| w == b"eXIf"));
    let again = Picture::decode(&png).unwrap();
    assert_eq!(
        again,
        Picture {
            colour: Subsamp::None,
            ..source.clone()
        }
    );
    assert_eq!(again.metadata.exif(), Some(&exif_segment()[10..]));
    let jpeg = Picture::decode(&again.to_jpeg(85).unwrap()).unwrap();
    assert_eq!(jpeg.metadata, again.metadata);
}

#[test]
fn pictures_side_by_side_keep_their_pixels_and_metadata() {
    let mut left = ramp(20, 30);
    left.metadata = Metadata::new(Some(exif_segment()[10..].to_vec()), None, None);
    left.colour = Subsamp::Sub2x2;
    let right = Picture::of_colour(10, 25, [1, 2, 3]).unwrap();
    let both = left.beside(&right, 4).unwrap();
    assert_eq!((both.width(), both.height()), (34, 30));
    assert_eq!(both.colour(19, 29), left.colour(19, 29));
    assert_eq!(both.colour(24, 0), Some([1, 2, 3]));
    assert_eq!(both.colour(33, 24), Some([1, 2, 3]));
    for white in [(20, 0), (23, 29), (24, 25), (33, 29)] {
        assert_eq!(both.colour(white.0, white.1), Some([255; 3]), "{white:?}");
    }
    assert_eq!((&both.metadata, both.colour), (&left.metadata, left.colour));
}
