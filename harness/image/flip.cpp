#include "harness/image/flip.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/image/colour.h"
#include "harness/image/filter.h"

namespace gnomon {
namespace {

constexpr double kPi = std::numbers::pi;

/// Replaces each pixel's three values by what `change` makes of them.
template <class Change>
void transform(Planes& p, const Change& change) {
  forEachPixel(p[0].width, p[0].height, [&](std::size_t x, std::size_t y) {
    double &a = p[0].row(y)[x], &b = p[1].row(y)[x], &c = p[2].row(y)[x];
    const Vec changed = change(Vec{a, b, c});
    a = changed.x;
    b = changed.y;
    c = changed.z;
  });
}

// --- "Spatial Filtering": contrast sensitivity as sums of Gaussians, S(f) = sum a exp(-b f^2) with
// f in cycles per degree; in space, at x degrees, sum a sqrt(pi / b) exp(-pi^2 x^2 / b).

struct Gaussian {
  double a, b;
};

/// Table 1. The papers give the first two a second term of weight 0.
constexpr std::array<std::array<Gaussian, 2>, 3> kSensitivity = {
    {{{{1, 0.0047}, {0, 1e-5}}},         // achromatic, Y
     {{{1, 0.0053}, {0, 1e-5}}},         // red-green, Cx
     {{{34.1, 0.04}, {13.5, 0.025}}}}};  // blue-yellow, Cz

/// Three standard deviations of the widest Gaussian, sqrt(b / (2 pi^2)) degrees, for all channels.
int sensitivityRadius(double pixelsPerDegree) {
  return static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * pixelsPerDegree));
}

/// One Gaussian as two passes, of sum 1; and the weight it has in two dimensions before that.
struct SeparableGaussian {
  Kernel kernel;
  double weight;
};

SeparableGaussian separable(const Gaussian& g, double pixelsPerDegree) {
  Kernel k = sampled(sensitivityRadius(pixelsPerDegree), [&](double i) {
    const double degrees = i / pixelsPerDegree;
    return std::exp(-kPi * kPi * degrees * degrees / g.b);
  });
  const double sum = std::accumulate(k.begin(), k.end(), 0.0);
  for (double& tap : k) tap /= sum;
  return {k, g.a * std::sqrt(kPi / g.b) * sum * sum};
}

/// A sum of two separable filters is not separable: each is applied by itself. The whole has sum 1.
Plane sensitivityFiltered(const Plane& in, const std::array<Gaussian, 2>& gaussians,
                          double pixelsPerDegree) {
  const std::array terms = {separable(gaussians[0], pixelsPerDegree),
                            separable(gaussians[1], pixelsPerDegree)};
  const int width = static_cast<int>(in.width), height = static_cast<int>(in.height);
  Plane out(width, height), half(width, height);
  for (const auto& [kernel, weight] : terms) {
    if (weight == 0) continue;
    Kernel vertical = kernel;
    for (double& tap : vertical) tap *= weight / (terms[0].weight + terms[1].weight);
    filterRows(in, kernel, half);
    addFilteredColumns(half, vertical, out);
  }
  return out;
}

/// What the eye resolves, back in the display's gamut, in Hunt-adjusted L*a*b*.
Planes perceived(const Planes& ycxcz, double pixelsPerDegree) {
  Planes p = {sensitivityFiltered(ycxcz[0], kSensitivity[0], pixelsPerDegree),
              sensitivityFiltered(ycxcz[1], kSensitivity[1], pixelsPerDegree),
              sensitivityFiltered(ycxcz[2], kSensitivity[2], pixelsPerDegree)};
  transform(p, [](const Vec& v) {
    const Vec rgb = rgbFromYcxcz(v);
    return huntLabFromRgb(
        {std::clamp(rgb.x, 0.0, 1.0), std::clamp(rgb.y, 0.0, 1.0), std::clamp(rgb.z, 0.0, 1.0)});
  });
  return p;
}

// --- "Color Metric and Error Redistribution".

/// HyAB to the power qc, mapped to [0, 1]: differences up to pc of the largest (green against blue)
/// take the range up to pt, the rest what remains.
double colourError(const Vec& reference, const Vec& test) {
  constexpr double kQc = 0.7, kPc = 0.4, kPt = 0.95;
  static const double cmax =
      std::pow(hyab(huntLabFromRgb({0, 1, 0}), huntLabFromRgb({0, 0, 1})), kQc);
  const double error = std::pow(hyab(reference, test), kQc);
  if (error < kPc * cmax) return kPt / (kPc * cmax) * error;
  return kPt + (error - kPc * cmax) / (cmax - kPc * cmax) * (1 - kPt);
}

// --- "Feature Pipeline": edges and points in the achromatic channel.

/// Scales what is positive to sum 1 and what is negative to sum -1.
Kernel normalised(Kernel k) {
  double positive = 0, negative = 0;
  for (const double tap : k) (tap > 0 ? positive : negative) += std::abs(tap);
  for (double& tap : k) tap /= tap > 0 ? positive : negative > 0 ? negative : 1;
  return k;
}

struct FeatureKernels {
  Kernel smooth, edge, point;  ///< a Gaussian and its first and second derivative
};

/// The width w = 0.082 degrees is two standard deviations; taps reach three.
FeatureKernels featureKernels(double pixelsPerDegree) {
  const double sigma = 0.5 * 0.082 * pixelsPerDegree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const auto g = [sigma](double x) { return std::exp(-x * x / (2 * sigma * sigma)); };
  return {.smooth = normalised(sampled(radius, g)),
          .edge = normalised(sampled(radius, [&](double x) { return -x * g(x); })),
          .point = normalised(
              sampled(radius, [&](double x) { return (x * x / (sigma * sigma) - 1) * g(x); }))};
}

struct Features {
  Plane edge, point;  ///< the gradient's length, and that of the second derivatives
};

/// Replaces a by the length of (a, b).
void combine(Plane& a, const Plane& b) {
  forEachPixel(a.width, a.height, [&](std::size_t x, std::size_t y) {
    const double u = a.row(y)[x], v = b.row(y)[x];
    a.row(y)[x] = std::sqrt(u * u + v * v);
  });
}

Features featuresOf(const Plane& luminance, const FeatureKernels& k) {
  const int width = static_cast<int>(luminance.width), height = static_cast<int>(luminance.height);
  Plane rows(width, height), edge(width, height), point(width, height), edgeY(width, height),
      pointY(width, height);
  filterRows(luminance, k.edge, rows);
  addFilteredColumns(rows, k.smooth, edge);
  filterRows(luminance, k.point, rows);
  addFilteredColumns(rows, k.smooth, point);
  filterRows(luminance, k.smooth, rows);
  addFilteredColumns(rows, k.edge, edgeY);
  addFilteredColumns(rows, k.point, pointY);
  combine(edge, edgeY);
  combine(point, pointY);
  return {std::move(edge), std::move(point)};
}

/// "Feature Metric": the larger of both differences, over its largest value sqrt(2), to the power
/// qf = 0.5.
double featureError(double edgeDifference, double pointDifference) {
  return std::sqrt(std::max(std::abs(edgeDifference), std::abs(pointDifference)) /
                   std::numbers::sqrt2);
}

// --- The whole.

/// Both images with values in [0, 1]; their error goes to `map` where it is larger than what is
/// there. "Final Difference": a feature's difference raises the colour's.
void raiseByLdrFlip(Planes& reference, Planes& test, double pixelsPerDegree,
                    std::vector<float>& map) {
  transform(reference, ycxczFromRgb);
  transform(test, ycxczFromRgb);
  const Planes a = perceived(reference, pixelsPerDegree), b = perceived(test, pixelsPerDegree);
  const FeatureKernels kernels = featureKernels(pixelsPerDegree);
  const Features f = featuresOf(reference[0], kernels), g = featuresOf(test[0], kernels);
  forEachPixel(a[0].width, a[0].height, [&](std::size_t x, std::size_t y) {
    const double colour = colourError({a[0].row(y)[x], a[1].row(y)[x], a[2].row(y)[x]},
                                      {b[0].row(y)[x], b[1].row(y)[x], b[2].row(y)[x]});
    // Features are those of (Y + 16) / 116, in [0, 1]; the kernels' sum is 0, so 16 drops out.
    const double feature = featureError((f.edge.row(y)[x] - g.edge.row(y)[x]) / 116,
                                        (f.point.row(y)[x] - g.point.row(y)[x]) / 116);
    float& out = map[y * a[0].width + x];
    out = std::max(out, static_cast<float>(std::pow(colour, 1 - feature)));
  });
}

/// The view's values after `change`; NaN and infinities count as 0 in both images, for a filter
/// would spread them: raiseMismatched() judges them.
template <class Change>
Planes load(const RgbView& view, const Change& change) {
  const Plane zeros(view.width, view.height);
  Planes p = {zeros, zeros, zeros};
  for (std::size_t c = 0; c < 3; ++c)
    forEachPixel(p[c].width, p[c].height, [&](std::size_t x, std::size_t y) {
      const float v = view.planes[c][y * p[c].width + x];
      p[c].row(y)[x] = std::isfinite(v) ? std::clamp(change(static_cast<double>(v)), 0.0, 1.0) : 0;
    });
  return p;
}

bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// A NaN or an infinity in one image and not the same in the other is an infinite error.
void raiseMismatched(const RgbView& reference, const RgbView& test, std::vector<float>& map) {
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < map.size(); ++i) {
      const float a = reference.planes[c][i], b = test.planes[c][i];
      if ((!std::isfinite(a) || !std::isfinite(b)) && !same(a, b))
        map[i] = std::numeric_limits<float>::infinity();
    }
}

Flip summed(const RgbView& reference, const RgbView& test, std::vector<float> map) {
  raiseMismatched(reference, test, map);
  const auto worst = std::ranges::max_element(map);
  const int at = static_cast<int>(worst - map.begin());
  const double sum = std::accumulate(map.begin(), map.end(), 0.0);
  const double mean = sum / static_cast<double>(map.size()), max = static_cast<double>(*worst);
  return {.map = std::move(map),
          .mean = mean,
          .max = max,
          .maxAt = {at % reference.width, at / reference.width}};
}

/// ACES as Narkowicz fitted it, without its pre-exposure of 0.6 ("Tone Mapping" of the HDR paper):
/// (k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5), with k2 = 0; rises from 0 for x >= 0.
constexpr double kAces[6] = {0.36 * 2.51, 0.6 * 0.03, 0, 0.36 * 2.43, 0.6 * 0.59, 0.14};

double aces(double x) {
  return (kAces[0] * x * x + kAces[1] * x) / (kAces[3] * x * x + kAces[4] * x + kAces[5]);
}

/// The positive x with aces(x) = t: the quadratic that follows from the quotient.
double acesInverse(double t) {
  const double a = kAces[0] - t * kAces[3], b = kAces[1] - t * kAces[4], c = -t * kAces[5];
  return (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
}

/// Luminance of each pixel whose three values are finite.
std::vector<double> luminances(const RgbView& view) {
  std::vector<double> all;
  for (std::size_t i = 0; i < view.planes[0].size(); ++i) {
    const double r = static_cast<double>(view.planes[0][i]),
                 g = static_cast<double>(view.planes[1][i]),
                 b = static_cast<double>(view.planes[2][i]);
    const double y = 0.2126 * r + 0.7152 * g + 0.0722 * b;  // BT.709
    if (std::isfinite(y)) all.push_back(y);
  }
  return all;
}

/// The upper one where the number is even, as the authors' evaluator has it.
double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void requireSame(const RgbView& reference, const RgbView& test) {
  if (reference.width != test.width || reference.height != test.height)
    throw UsageError(fmt::format("the images differ in size: {} x {} and {} x {}", reference.width,
                                 reference.height, test.width, test.height));
}

bool exceedsOne(const RgbView& view) {
  return std::ranges::any_of(view.planes, [](std::span<const float> plane) {
    return std::ranges::any_of(plane, [](float v) { return std::isfinite(v) && v > 1; });
  });
}

}  // namespace

std::vector<std::string> colourLayers(const Image& image) {
  std::vector<std::string> layers;
  for (const std::string& channel : image.channels) {
    if (channel != "R" && !channel.ends_with(".R")) continue;
    const std::string prefix = channel.substr(0, channel.size() - 1);
    if (image.find(prefix + "G") && image.find(prefix + "B"))
      layers.push_back(prefix.empty() ? "" : prefix.substr(0, prefix.size() - 1));
  }
  return layers;
}

RgbView rgbOf(const Image& image, const std::string& layer) {
  RgbView view{.width = image.width, .height = image.height};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string name = (layer.empty() ? "" : layer + ".") + "RGB"[c];
    const auto found = image.find(name);
    if (!found)
      throw UsageError(
          fmt::format("FLIP needs channel {}; the image has {}", name, shapeOf(image)));
    view.planes[c] = image.plane(*found);
  }
  return view;
}

Flip ldrFlip(const RgbView& reference, const RgbView& test, double pixelsPerDegree) {
  assert(pixelsPerDegree > 0);
  requireSame(reference, test);
  const auto unchanged = [](double v) { return v; };
  Planes a = load(reference, unchanged), b = load(test, unchanged);
  std::vector<float> map(reference.planes[0].size());
  raiseByLdrFlip(a, b, pixelsPerDegree, map);
  return summed(reference, test, std::move(map));
}

Flip hdrFlip(const RgbView& reference, const RgbView& test, const Exposures& exposures,
             double pixelsPerDegree) {
  assert(pixelsPerDegree > 0 && exposures.count > 0);
  requireSame(reference, test);
  std::vector<float> map(reference.planes[0].size());
  const int steps = std::max(1, exposures.count - 1);
  for (int i = 0; i < exposures.count; ++i) {
    const double c = exposures.start + i * (exposures.stop - exposures.start) / steps;
    const auto exposed = [scale = std::exp2(c)](double v) {
      return aces(std::max(0.0, scale * v));
    };
    Planes a = load(reference, exposed), b = load(test, exposed);
    raiseByLdrFlip(a, b, pixelsPerDegree, map);
  }
  Flip result = summed(reference, test, std::move(map));
  result.hdr = true;
  result.exposures = exposures;
  return result;
}

Flip flip(const RgbView& reference, const RgbView& test, double pixelsPerDegree) {
  requireSame(reference, test);
  if (exceedsOne(reference) || exceedsOne(test))
    return hdrFlip(reference, test, exposuresOf(reference), pixelsPerDegree);
  return ldrFlip(reference, test, pixelsPerDegree);
}

Exposures exposuresOf(const RgbView& reference) {
  // A median of 1e-30 would ask for a hundred exposures, most of them of noise: the range is kept,
  // the steps grow.
  constexpr int kMaxExposures = 32;
  std::vector<double> y = luminances(reference);
  double largest = y.empty() ? 0 : std::ranges::max(y);
  double middle = y.empty() ? 0 : median(y);
  if (largest <= 0) largest = middle = 1;
  if (middle <= 0) {
    std::erase_if(y, [](double v) { return v <= 0; });
    middle = median(y);
  }
  const double x = acesInverse(0.85);
  const Exposures e{.start = std::log2(x / largest), .stop = std::log2(x / middle)};
  const double count = std::clamp(std::ceil(e.stop - e.start), 2.0, double{kMaxExposures});
  return {.start = e.start, .stop = e.stop, .count = static_cast<int>(count)};
}

}  // namespace gnomon
