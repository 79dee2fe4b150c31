# SPDX-License-Identifier: MIT
"""Pictures as arrays of floats, and what is done with them: display, means of blocks, differences."""
import numpy
import OpenImageIO

# The fit of the ACES film curve by Hill (2016), as three.js has it ("ACESFilmic"): colours to its space, and back.
TO_ACES = numpy.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
FROM_ACES = numpy.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
ACES_WHITE = 0.6  # light is divided by that
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])


def read(path):
    """height x width x channels, of 0 to 1 for files of 8 bits."""
    image = OpenImageIO.ImageBuf(str(path))
    if image.has_error:
        raise OSError(f"{path}: {image.geterror()}")
    return image.get_pixels(OpenImageIO.FLOAT)


def with_alpha(pixels):
    return pixels if pixels.shape[2] == 4 else numpy.dstack([pixels, numpy.ones(pixels.shape[:2], pixels.dtype)])


def write(path, pixels):
    image = OpenImageIO.ImageBuf(numpy.ascontiguousarray(numpy.clip(pixels, 0, 1), dtype=numpy.float32))
    if not image.write(str(path), "uint8" if path.suffix == ".png" else "half"):
        raise OSError(f"{path}: {image.geterror()}")


def to_srgb(linear):
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * numpy.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def displayed(linear):
    """As the reference pictures are: the ACES fit, then sRGB."""
    film = (linear / ACES_WHITE) @ TO_ACES.T
    film = (film * (film + 0.0245786) - 0.000090537) / (film * (0.983729 * film + 0.4329510) + 0.238081)
    return to_srgb(numpy.clip(film @ FROM_ACES.T, 0, 1))


def block_means(pixels, side):
    """Means of blocks of side x side pixels; what is left at the edges is dropped."""
    rows, columns = pixels.shape[0] // side, pixels.shape[1] // side
    return pixels[:rows * side, :columns * side].reshape(rows, side, columns, side, -1).mean(axis=(1, 3))


def difference(one, other, mask):
    """Mean absolute difference in steps of 255, where the mask is."""
    return 255 * float(numpy.abs(one - other)[mask].mean())
