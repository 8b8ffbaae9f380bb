//! Kinds of pixels: what they become, and which are refused.

use super::*;

#[test]
fn tiff_of_eight_bits_keeps_every_pixel() {
    let picture = ramp(33, 21);
    let colour = encoded(&rgb_image(&picture), ImageFormat::Tiff);
    assert_eq!(Picture::decode(&colour).unwrap(), picture);
    let grey = DynamicImage::ImageLuma8(image::GrayImage::from_fn(9, 4, |x, y| {
        image::Luma([u8::try_from(x * 20 + y).unwrap()])
    }));
    let grey = Picture::decode(&encoded(&grey, ImageFormat::Tiff)).unwrap();
    assert_eq!(grey.colour(8, 3), Some([163, 163, 163]));
}

#[test]
fn transparency_is_dropped() {
    let image = image::RgbaImage::from_pixel(5, 4, image::Rgba([10, 20, 30, 0]));
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let bytes = encoded(&DynamicImage::ImageRgba8(image.clone()), format);
        let picture = Picture::decode(&bytes).unwrap();
        assert_eq!(picture.colour(2, 2), Some([10, 20, 30]));
        assert_eq!(picture.rgba()[3], 255);
    }
}

/// Of 1000 samples 1000, 1001 ... 1999, the 0.5th percentile is 1004 and the 99.5th 1994.
#[test]
fn sixteen_bits_are_stretched_between_the_percentiles() {
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(100, 10, |x, y| {
        image::Luma([1000 + u16::try_from(y * 100 + x).unwrap()])
    });
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let bytes = encoded(&DynamicImage::ImageLuma16(image.clone()), format);
        let picture = Picture::decode(&bytes).unwrap();
        let grey = |value: u32| picture.colour(value % 100, value / 100).unwrap()[0];
        assert_eq!([grey(0), grey(4), grey(994), grey(999)], [0, 0, 255, 255]);
        assert_eq!(grey(499), 128); // (1499 - 1004) / 990 of 255 is 127.5.
        assert_eq!((grey(5), grey(8)), (0, 1));
    }
}

#[test]
fn colours_of_sixteen_bits_share_one_stretch() {
    let image = image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(30, 30, |x, _| {
        image::Rgb(if x < 15 {
            [0, 0, 0]
        } else {
            [40_000, 20_000, 10_000]
        })
    });
    let bytes = encoded(&DynamicImage::ImageRgb16(image), ImageFormat::Png);
    let picture = Picture::decode(&bytes).unwrap();
    assert_eq!(picture.colour(20, 3), Some([255, 128, 64]));
}

/// The ramp in printing colours, as Adobe counts them: no black ink, and light instead of inks.
fn printed(subsamp: Subsamp) -> Vec<u8> {
    let picture = ramp(64, 48);
    let image = turbojpeg::Image {
        pixels: picture.rgba(),
        width: 64,
        pitch: 256,
        height: 48,
        format: turbojpeg::PixelFormat::CMYK,
    };
    turbojpeg::compress(image, 95, subsamp).unwrap().to_vec()
}

/// Where the content of Adobe's segment begins.
fn adobe_segment(jpeg: &[u8]) -> usize {
    let name = jpeg.windows(5).position(|w| w == b"Adobe").unwrap();
    assert_eq!(jpeg[name - 4..name - 2], [0xff, 0xee]);
    name
}

#[test]
fn printing_colours_become_red_green_and_blue() {
    let ramp = ramp(64, 48);
    for subsamp in [Subsamp::None, Subsamp::Sub2x2] {
        let jpeg = printed(subsamp);
        assert_eq!(jpeg[adobe_segment(&jpeg) + 11], 2, "YCCK");
        let picture = Picture::decode(&jpeg).unwrap();
        let worst = picture.rgba().iter().zip(ramp.rgba());
        assert!(worst.map(|(a, b)| a.abs_diff(*b)).max().unwrap() < 16);
        // The copy is a picture for screens.
        let header = turbojpeg::read_header(&picture.to_jpeg(90).unwrap()).unwrap();
        let found = (header.colorspace, header.subsamp);
        assert_eq!(found, (turbojpeg::Colorspace::YCbCr, subsamp));
    }
    let rgba = [200, 100, 50, 51].repeat(64); // black ink that leaves a fifth of the light
    let image = turbojpeg::Image {
        pixels: rgba.as_slice(),
        width: 8,
        pitch: 32,
        height: 8,
        format: turbojpeg::PixelFormat::CMYK,
    };
    let dark = turbojpeg::compress(image, 100, Subsamp::None).unwrap();
    let [r, g, b] = Picture::decode(&dark).unwrap().colour(3, 3).unwrap();
    assert!(r.abs_diff(40) < 2 && g.abs_diff(20) < 2 && b.abs_diff(10) < 2);
}

#[test]
fn what_is_not_read_is_told_in_exact_words() {
    let words = |bytes: &[u8]| Picture::decode(bytes).unwrap_err().to_string();
    let mut nameless = printed(Subsamp::None);
    let name = adobe_segment(&nameless);
    nameless[name] = b'a';
    assert_eq!(
        words(&nameless),
        "found a JPEG picture that cannot be decoded (CMYK without Adobe's segment, by which 0 is all \
         ink), expected a sound one"
    );
    let mut tiff = Cursor::new(Vec::new());
    let mut file = tiff::encoder::TiffEncoder::new(&mut tiff).unwrap();
    file.write_image::<tiff::encoder::colortype::Gray32Float>(2, 1, &[0.5, 1.5])
        .unwrap();
    assert_eq!(
        words(&tiff.into_inner()),
        "found a TIFF picture that cannot be decoded (pixels of 32 bits of a kind that is not read), \
         expected a sound one"
    );
}
