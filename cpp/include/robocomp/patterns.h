// The three patterns of communication as RoboComp's paper has them: `speechcomm->query<isBusy>(response)`.
#pragma once

#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>

// The name of an operation as a type. It calls the operation of a client or a publisher.
#define RC_OPERATION(Name)                                                                       \
  struct Name {                                                                                  \
    template <class End, class... Data>                                                          \
    static auto rc_call(const End& end, Data&&... data)                                          \
        -> decltype(end.Name(std::forward<Data>(data)...)) {                                     \
      return end.Name(std::forward<Data>(data)...);                                              \
    }                                                                                            \
  };

// The data of a request or a response.
template <class T>
class RoboCompData {
 public:
  RoboCompData() = default;
  RoboCompData(T value) : value_(std::move(value)) {}
  T* operator->() { return &value_; }
  const T* operator->() const { return &value_; }
  T& operator*() { return value_; }
  const T& operator*() const { return value_; }

 private:
  T value_{};
};

namespace rc {

// The patterns of a slot, over its client or publisher.
template <class End>
class Communication {
 public:
  explicit Communication(std::shared_ptr<End> end) : end_(std::move(end)) {}
  Communication* operator->() { return this; }

  // Calls an operation with a response: an `out` parameter, or its result.
  template <class Operation, class... Data>
  void query(Data&&... data) {
    if constexpr (is_callable<Operation, void, Data...>::value) {
      Operation::rc_call(*end_, *data...);
    } else {
      with_result<Operation>(std::forward_as_tuple(data...),
                             std::make_index_sequence<sizeof...(Data) - 1>{});
    }
  }
  // Calls an operation without a response.
  template <class Operation, class... Data>
  void command(Data&&... data) {
    Operation::rc_call(*end_, *data...);
  }
  // Publishes a sample.
  template <class Operation, class... Data>
  void publish(Data&&... data) {
    Operation::rc_call(*end_, *data...);
  }

 private:
  template <class Operation, class Void, class... Data>
  struct is_callable : std::false_type {};
  template <class Operation, class... Data>
  struct is_callable<
      Operation,
      std::void_t<decltype(Operation::rc_call(std::declval<const End&>(), *std::declval<Data&>()...))>,
      Data...> : std::true_type {};

  template <class Operation, class All, std::size_t... At>
  void with_result(All all, std::index_sequence<At...>) {
    *std::get<sizeof...(At)>(all) = Operation::rc_call(*end_, *std::get<At>(all)...);
  }

  std::shared_ptr<End> end_;
};

}  // namespace rc
