// Slot arrays, whose members the worker opens in `initialize`.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "robocomp/cdr.h"
#include "robocomp/errors.h"

namespace rc {

// A member of a slot array.
class Member {
 public:
  Member() = default;
  Member(std::size_t index, std::string name) : index_(index), name_(std::move(name)) {}

  // Its number in the array, in the order in which the worker opened the members, from 0.
  std::size_t index() const { return index_; }
  // Its name, as the worker opened it.
  const std::string& name() const { return name_; }

  friend bool operator==(const Member& a, const Member& b) { return a.name_ == b.name_; }
  friend bool operator!=(const Member& a, const Member& b) { return !(a == b); }
  friend bool operator<(const Member& a, const Member& b) { return a.index_ < b.index_; }

 private:
  std::size_t index_ = 0;
  std::string name_;
};

// A slot array that implements or subscribes.
class Members {
 public:
  explicit Members(std::size_t array) : array_(array) {}

  // Opens a member. Throws `rc::MemberError`.
  Member open(const std::string& name) { return opened(name).first; }
  // Opens the members that the network lists.
  void open_listed() {
    for (const std::string& name : listed().value_or(std::vector<std::string>{})) open(name);
  }
  // The names of the members that the network lists; none if the component was started by hand without
  // them.
  std::optional<std::vector<std::string>> listed() const {
    const rc_answer answer = detail::checked(robocomp_get(RC_LISTED, array_));
    if (answer.number < 0) return std::nullopt;
    std::vector<std::string> names;
    detail::Reader(answer.bytes).get(names);
    return names;
  }
  // The open members.
  const std::vector<Member>& members() const { return members_; }
  std::size_t size() const { return members_.size(); }
  // The open member with this name.
  std::optional<Member> get(const std::string& name) const {
    for (const Member& member : members_) {
      if (member.name() == name) return member;
    }
    return std::nullopt;
  }

 protected:
  // Opens a member. Returns it with the number of its slot.
  std::pair<Member, std::size_t> opened(const std::string& name) {
    const rc_answer answer =
        detail::checked(robocomp_set(RC_OPEN, array_, 0, detail::bytes(name)));
    members_.emplace_back(members_.size(), name);
    return {members_.back(), static_cast<std::size_t>(answer.number)};
  }

 private:
  std::size_t array_;
  std::vector<Member> members_;
};

// A slot array that requires or publishes: `End` is the client or the publisher of a member.
template <class End>
class Array : public Members {
 public:
  using Members::Members;

  Member open(const std::string& name) {
    auto [member, slot] = opened(name);
    ends_.emplace_back(slot);
    return member;
  }
  void open_listed() {
    for (const std::string& name : listed().value_or(std::vector<std::string>{})) open(name);
  }
  // The client or the publisher of a member.
  const End& operator[](const Member& member) const {
    if (member.index() >= ends_.size()) {
      throw MemberError("`" + member.name() + "` is no member of this array");
    }
    return ends_[member.index()];
  }
  // Those of all members, in the order of their opening.
  auto begin() const { return ends_.begin(); }
  auto end() const { return ends_.end(); }

 private:
  std::vector<End> ends_;
};

}  // namespace rc
