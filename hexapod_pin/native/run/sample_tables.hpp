// Tables of samples, row by row, in one block of memory: a run whose length is known touches fresh
// memory once, and the block can be handed over without a copy.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace hexapod {

struct SampleTable {
  const char* name;
  std::size_t width;       // numbers per sample; 0 where it is not kept
  double* next = nullptr;  // where the next number goes

  template <class Vector>
  void append(const Vector& v) {
    if (width == 0) return;
    next = std::copy(v.data(), v.data() + v.size(), next);
  }
  void append(double x) {
    if (width > 0) *next++ = x;
  }
};

class SampleTables {
 public:
  explicit SampleTables(std::vector<SampleTable> tables) : tables_(std::move(tables)) {
    for (const SampleTable& table : tables_) row_width_ += table.width;
  }

  SampleTable& operator[](std::size_t table) { return tables_[table]; }
  const std::vector<SampleTable>& tables() const { return tables_; }
  std::size_t rows() const { return rows_; }

  // Room for so many more rows; beyond kReservedNumbers the block grows as it fills.
  void reserve(std::size_t more) {
    const std::size_t most = std::max<std::size_t>(1, kReservedNumbers / row_width_);
    const std::size_t wanted = rows_ + std::min(more, most);
    if (wanted > capacity_) move_to(wanted);
  }

  // Every table takes its width of numbers between two calls.
  void begin_row() {
    if (rows_ == capacity_) move_to(std::max<std::size_t>(1, 2 * capacity_));
    else if (handed_over_) move_to(capacity_);
    ++rows_;
  }

  // The block with the rows so far, (rows, width) of each table one after the other at `offset`. It
  // is not written again: whatever follows is recorded in another one.
  std::shared_ptr<const double[]> hand_over() {
    if (handed_over_) move_to(capacity_);
    handed_over_ = true;
    return block_;
  }
  std::size_t offset(std::size_t table) const {
    std::size_t before = 0;
    for (std::size_t k = 0; k < table; ++k) before += tables_[k].width;
    return before * capacity_;
  }

 private:
  static constexpr std::size_t kReservedNumbers = std::size_t(1) << 24;  // 128 MiB of doubles

  // A very large block asks for huge pages: taking its memory page by page costs up to a sixth of a
  // run. For smaller ones clearing huge pages costs more than it saves.
  static std::shared_ptr<double[]> allocate(std::size_t numbers) {
    constexpr std::size_t kHugePage = std::size_t(1) << 21, kVeryLarge = 16 * kHugePage;  // bytes
    std::size_t bytes = numbers * sizeof(double);
    if (bytes < kVeryLarge) return std::shared_ptr<double[]>(new double[numbers]);
    bytes = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    auto* memory = static_cast<double*>(std::aligned_alloc(kHugePage, bytes));
    if (memory == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: without it all is as before, only slower
#endif
    return std::shared_ptr<double[]>(memory, std::free);
  }

  void move_to(std::size_t capacity) {
    std::shared_ptr<double[]> block = allocate(capacity * row_width_);
    double* to = block.get();
    const double* from = block_.get();
    for (SampleTable& table : tables_) {
      const std::size_t used = rows_ * table.width;
      table.next = std::copy_n(from, used, to);
      to += capacity * table.width;
      from += capacity_ * table.width;
    }
    block_ = std::move(block);
    capacity_ = capacity;
    handed_over_ = false;
  }

  std::vector<SampleTable> tables_;
  std::shared_ptr<double[]> block_;
  std::size_t row_width_ = 0, rows_ = 0, capacity_ = 0;
  bool handed_over_ = false;
};

}  // namespace hexapod
