// Addresses of samples in place that end with their view or loan, in builds for debugging.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <utility>

namespace rc::detail {

#ifdef NDEBUG
inline constexpr bool CHECKS_POINTERS = false;
#else
inline constexpr bool CHECKS_POINTERS = true;
#endif

// The addresses of the samples that ended last. Nothing gets them again, so a pointer that was kept is a crash
// at its next use.
class EndedAddresses {
 public:
  // Takes over a mapping: its memory goes, its addresses stay until as many others have ended.
  void add(void* begin, std::size_t size) {
    const std::lock_guard<std::mutex> held(adds_);
    Range& range = ranges_[next_];
    next_ = (next_ + 1) % ranges_.size();
    const std::size_t old_size = range.size.exchange(0);
    void* const old = range.begin.exchange(nullptr);
    if (old_size != 0) munmap(old, old_size);
    constexpr int how = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED;
    if (mmap(begin, size, PROT_NONE, how, -1, 0) == MAP_FAILED) {
      munmap(begin, size);
      return;
    }
    range.begin = begin;
    range.size = size;
  }

  // Whether an address was that of a sample. Takes no lock: the report of a crash asks.
  bool has(const void* address) const {
    for (const Range& range : ranges_) {
      const auto begin = reinterpret_cast<std::uintptr_t>(range.begin.load());
      const auto at = reinterpret_cast<std::uintptr_t>(address);
      if (at >= begin && at - begin < range.size) return true;
    }
    return false;
  }

 private:
  struct Range {
    std::atomic<void*> begin{nullptr};
    std::atomic<std::size_t> size{0};
  };

  std::mutex adds_;
  std::array<Range, 64> ranges_;
  std::size_t next_ = 0;
};

inline EndedAddresses ended_addresses;

// Addresses of the memory of a sample that are of this object alone, and end with it. Shared memory gets a second
// mapping of the same pages; memory of the process is copied. Without checks it is the memory itself.
class Expiring {
 public:
  Expiring() = default;
  Expiring(const void* memory, std::size_t size) : memory_(const_cast<void*>(memory)), size_(size) {
    if constexpr (CHECKS_POINTERS) map();
  }
  Expiring(Expiring&& other) noexcept { swap(other); }
  Expiring& operator=(Expiring&& other) noexcept {
    if (this != &other) {
      end();
      swap(other);
    }
    return *this;
  }
  ~Expiring() { end(); }

  void* place() const { return begin_ == nullptr ? memory_ : static_cast<char*>(begin_) + offset_; }
  // Gives the memory what was written at the place.
  void write_back() const {
    if (is_copy_) std::memcpy(memory_, place(), size_);
  }
  void end() {
    if (begin_ != nullptr) ended_addresses.add(begin_, mapped_);
    begin_ = nullptr;
    memory_ = nullptr;
    is_copy_ = false;
  }

 private:
  void map() {
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    offset_ = reinterpret_cast<std::uintptr_t>(memory_) % page;
    mapped_ = (offset_ + size_ + page - 1) / page * page;
    void* const pages = static_cast<char*>(memory_) - offset_;
    // The old size 0 asks for a second mapping; Linux refuses it for memory of one process.
    void* begin = mremap(pages, 0, mapped_, MREMAP_MAYMOVE);
    if (begin == MAP_FAILED) {
      constexpr int how = MAP_PRIVATE | MAP_ANONYMOUS;
      begin = mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, how, -1, 0);
      if (begin == MAP_FAILED) return;
      is_copy_ = true;
      std::memcpy(static_cast<char*>(begin) + offset_, memory_, size_);
    }
    begin_ = begin;
  }

  void swap(Expiring& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(size_, other.size_);
    std::swap(begin_, other.begin_);
    std::swap(mapped_, other.mapped_);
    std::swap(offset_, other.offset_);
    std::swap(is_copy_, other.is_copy_);
  }

  void* memory_ = nullptr;
  std::size_t size_ = 0;
  // The mapping; null without checks.
  void* begin_ = nullptr;
  std::size_t mapped_ = 0;
  std::size_t offset_ = 0;
  bool is_copy_ = false;
};

}  // namespace rc::detail
