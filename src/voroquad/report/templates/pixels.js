// Pixels of images, packed small, and what a screen shows of them.

// The numbers that the 65536 patterns of a float16 stand for.
const HALF = Float32Array.from({ length: 65536 }, (_, bits) => {
  const [sign, exponent, mantissa] = [bits & 0x8000 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (exponent === 31) return mantissa ? NaN : sign * Infinity;
  return sign * (exponent ? (1 + mantissa / 1024) * 2 ** (exponent - 15) : mantissa * 2 ** -24);
});

// The sRGB transfer function in steps finer than those of a byte.
const STEPS = 4096;
const SRGB = Uint8Array.from({ length: STEPS }, (_, k) => {
  const linear = k / (STEPS - 1);
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055) + 0.5;
});

// Pixels as pack() in images.py left them: by channel, top row first.
async function unpack(base64) {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < packed.length; k++) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 2;
  const pixels = new Float32Array(count);
  for (let k = 0; k < count; k++) pixels[k] = HALF[bytes[k] | (bytes[count + k] << 8)];
  return pixels;
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// The byte that a screen shows of a linear value, so many stops brighter.
const shownByte = (value, exposure) => SRGB[clamp((STEPS - 1) * 2 ** exposure * value + 0.5, 0, STEPS - 1) | 0];

// The rgba pixel that a screen shows of three linear values.
function shownPixel(red, green, blue, exposure) {
  const byte = (value) => shownByte(value, exposure);
  return (0xff000000 | (byte(blue) << 16) | (byte(green) << 8) | byte(red)) >>> 0;
}

const stops = (exposure) => `${exposure > 0 ? "+" : ""}${exposure} EV`.replace("-", "−");
