// Time spent at magnitudes, in bins that follow a double's own exponent and top mantissa bits: 64 per
// octave, so that a bin is at most 1/64 of its value wide.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace hexapod {

class MagnitudeHistogram {
 public:
  MagnitudeHistogram() : weight_(kBins, 0.0) {}

  // `magnitude` >= 0, held for a time `weight`.
  void add(double magnitude, double weight) {
    const int bin = bin_of(magnitude);
    weight_[std::size_t(bin)] += weight;
    if (bin < first_) first_ = bin;
    if (bin > last_) last_ = bin;
  }

  // Takes over what another one holds, and empties it.
  void take(MagnitudeHistogram& other) {
    for (int bin = other.first_; bin <= other.last_; ++bin) {
      weight_[std::size_t(bin)] += other.weight_[std::size_t(bin)];
      other.weight_[std::size_t(bin)] = 0.0;
    }
    first_ = std::min(first_, other.first_), last_ = std::max(last_, other.last_);
    other.first_ = kBins, other.last_ = -1;
  }

  // The magnitude not exceeded for this share of the time, interpolated in its bin; 0 when empty.
  double quantile(double share) const {
    double total = 0.0;
    for (int bin = first_; bin <= last_; ++bin) total += weight_[std::size_t(bin)];
    double left = share * total;
    for (int bin = first_; bin <= last_; ++bin) {
      const double w = weight_[std::size_t(bin)];
      if (w > 0.0 && left <= w) return lower(bin) + (lower(bin + 1) - lower(bin)) * left / w;
      left -= w;
    }
    return last_ < 0 ? 0.0 : lower(last_ + 1);
  }

 private:
  static constexpr int kTopBits = 6, kPerOctave = 1 << kTopBits;
  static constexpr int kLowestExponent = -44, kOctaves = 104;  // 6e-14 to 1e18; smaller: as 0
  static constexpr int kBins = kOctaves * kPerOctave + 1;     // bin 0: below the lowest octave
  static constexpr std::int64_t kBias = 1023;                 // of a double's exponent

  static int bin_of(double magnitude) {
    std::int64_t bits;
    std::memcpy(&bits, &magnitude, sizeof bits);
    const std::int64_t key = (bits >> (52 - kTopBits)) - (kBias + kLowestExponent) * kPerOctave + 1;
    return int(std::clamp<std::int64_t>(key, 0, kBins - 1));
  }

  static double lower(int bin) {
    if (bin <= 0) return 0.0;
    const int octave = (bin - 1) / kPerOctave, part = (bin - 1) % kPerOctave;
    return std::ldexp(1.0 + double(part) / kPerOctave, kLowestExponent + octave);
  }

  std::vector<double> weight_;    // s
  int first_ = kBins, last_ = -1;  // bins in use
};

}  // namespace hexapod
