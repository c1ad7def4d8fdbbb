// A node of ROS 2 on Fast DDS, as `rmw_fastrtps` has it, by hand: names, types, and the Enhanced mapping of services, in which
// a request is known by its writer and its number, and a response says beside its body which one it is for.
//
//   fast NETWORK DOMAIN talk BYTES…   says strings of so many bytes to the component and hears them again
//   fast NETWORK DOMAIN ask           asks the component
//   fast NETWORK DOMAIN oracle        answers what the component asks, until its input ends
//
// With Debian's package libfastrtps-dev: c++ -std=c++17 fast.cpp -o fast -lfastrtps -lfastcdr

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SampleIdentity;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;

// Longest that anything is waited for.
constexpr auto LIMIT = std::chrono::seconds(20);
constexpr size_t LARGEST = 8 << 20;

using Bytes = std::vector<char>;

// A type whose values are their CDR.
class Encoded : public TopicDataType {
  public:
    explicit Encoded(const std::string &name) {
        setName(name.c_str());
        m_typeSize = 256;
        m_isGetKeyDefined = false;
        auto_fill_type_information(false);
        auto_fill_type_object(false);
    }
    bool serialize(void *data, SerializedPayload_t *payload) override {
        const auto &bytes = *static_cast<Bytes *>(data);
        payload->encapsulation = CDR_LE;
        payload->length = static_cast<uint32_t>(bytes.size());
        std::memcpy(payload->data, bytes.data(), bytes.size());
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override {
        const auto *begin = reinterpret_cast<char *>(payload->data);
        static_cast<Bytes *>(data)->assign(begin, begin + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void *data) override {
        const auto size = static_cast<uint32_t>(static_cast<Bytes *>(data)->size());
        return [size] { return size; };
    }
    void *createData() override { return new Bytes; }
    void deleteData(void *data) override { delete static_cast<Bytes *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

template <typename... Values> Bytes encoded(const Values &...values) {
    Bytes bytes(LARGEST);
    FastBuffer buffer(bytes.data(), bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    (cdr << ... << values);
    bytes.resize(cdr.getSerializedDataLength());
    return bytes;
}

// Reads a value of each of these types, one after the other.
template <typename... Values> std::tuple<Values...> decoded(Bytes bytes) {
    FastBuffer buffer(bytes.data(), bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::tuple<Values...> values;
    std::apply([&cdr](auto &...value) { (cdr >> ... >> value); }, values);
    return values;
}

template <typename End> End *made(End *end) {
    if (end == nullptr) {
        throw std::runtime_error("an end is refused");
    }
    return end;
}

template <typename Condition> void until(const char *what, Condition condition) {
    const auto end = std::chrono::steady_clock::now() + LIMIT;
    while (!condition()) {
        if (std::chrono::steady_clock::now() > end) {
            throw std::runtime_error(std::string("in vain: ") + what);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

// What services have, and topics here.
template <typename Qos> Qos quality() {
    Qos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.data_sharing().off();
    return qos;
}

class Node {
  public:
    Node(std::string network, uint32_t domain) : network(std::move(network)) {
        DomainParticipantQos qos;
        auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        loopback->interfaceWhiteList.emplace_back("127.0.0.1");
        qos.transport().use_builtin_transports = false;
        qos.transport().user_transports.push_back(loopback);
        member = made(DomainParticipantFactory::get_instance()->create_participant(domain, qos));
        publisher = made(member->create_publisher(PUBLISHER_QOS_DEFAULT));
        subscriber = made(member->create_subscriber(SUBSCRIBER_QOS_DEFAULT));
    }

    ~Node() {
        member->delete_contained_entities();
        DomainParticipantFactory::get_instance()->delete_participant(member);
    }

    DataWriter *writer(const std::string &prefix, const std::string &name, const std::string &type) {
        return made(publisher->create_datawriter(topic(prefix, name, type), quality<DataWriterQos>()));
    }

    DataReader *reader(const std::string &prefix, const std::string &name, const std::string &type) {
        return made(subscriber->create_datareader(topic(prefix, name, type), quality<DataReaderQos>()));
    }

  private:
    Topic *topic(const std::string &prefix, const std::string &name, const std::string &type) {
        TypeSupport support(new Encoded(type));
        support.register_type(member);
        return made(member->create_topic(prefix + "/" + network + "/" + name, type, TOPIC_QOS_DEFAULT));
    }

    std::string network;
    DomainParticipant *member;
    Publisher *publisher;
    Subscriber *subscriber;
};

// Takes the next value; none where `wait` passes without one.
std::optional<Bytes> next(DataReader *reader, SampleInfo &info, std::chrono::milliseconds wait = LIMIT) {
    const auto end = std::chrono::steady_clock::now() + wait;
    Bytes bytes;
    while (std::chrono::steady_clock::now() < end) {
        if (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
            if (info.valid_data) {
                return bytes;
            }
        } else {
            reader->wait_for_unread_message({0, 10'000'000});
        }
    }
    return std::nullopt;
}

void met(DataWriter *writer, DataReader *reader) {
    until("the other end", [=] {
        PublicationMatchedStatus of_writer;
        SubscriptionMatchedStatus of_reader;
        writer->get_publication_matched_status(of_writer);
        reader->get_subscription_matched_status(of_reader);
        return of_writer.current_count > 0 && of_reader.current_count > 0;
    });
}

class Client {
  public:
    Client(Node &node, const std::string &name, const std::string &type)
        : responses(node.reader("rr", name + "Reply", type + "_Response_")),
          requests(node.writer("rq", name + "Request", type + "_Request_")) {
        met(requests, responses);
    }

    // Sends a request and gives the response to it; none where `wait` passes without one.
    std::optional<Bytes> call(Bytes request, std::chrono::milliseconds wait = LIMIT) {
        WriteParams params;
        // As `rmw_fastrtps` does: a server may answer to the reader.
        params.related_sample_identity().writer_guid() = responses->guid();
        if (!requests->write(&request, params)) {
            throw std::runtime_error("a request cannot be sent");
        }
        const auto number = params.sample_identity().sequence_number();
        const auto end = std::chrono::steady_clock::now() + wait;
        SampleInfo info;
        while (std::chrono::steady_clock::now() < end) {
            auto response = next(responses, info, wait);
            const auto &to = info.related_sample_identity;
            const bool is_ours = to.writer_guid() == requests->guid() || to.writer_guid() == responses->guid();
            if (response && is_ours && to.sequence_number() == number) {
                return response;
            }
        }
        return std::nullopt;
    }

  private:
    DataReader *responses;
    DataWriter *requests;
};

class Server {
  public:
    Server(Node &node, const std::string &name, const std::string &type)
        : responses(node.writer("rr", name + "Reply", type + "_Response_")),
          requests(node.reader("rq", name + "Request", type + "_Request_")) {}

    void met() { ::met(responses, requests); }

    // Answers the next request, if there is one soon, by what `answer` makes of it.
    void serve(const std::function<std::optional<Bytes>(Bytes)> &answer) {
        SampleInfo info;
        auto request = next(requests, info, std::chrono::milliseconds(20));
        if (!request) {
            return;
        }
        SampleIdentity to = info.sample_identity;
        if (const auto &reader = info.related_sample_identity.writer_guid(); reader != GUID_t::unknown()) {
            to.writer_guid(reader);
        }
        if (auto response = answer(*request)) {
            WriteParams params;
            params.related_sample_identity(to);
            if (!responses->write(&*response, params)) {
                throw std::runtime_error("a response cannot be sent");
            }
        }
    }

  private:
    DataWriter *responses;
    DataReader *requests;
};

void talk(Node &node, const std::vector<size_t> &sizes) {
    const std::string type = "std_msgs::msg::dds_::String_";
    auto *heard = node.reader("rt", "Gossip/chatter", type);
    auto *said = node.writer("rt", "Talk/chatter", type);
    met(said, heard);
    // A component of ROS 2 does not say when it has found an end.
    std::cout << "met" << std::endl;
    std::string line;
    std::getline(std::cin, line);
    for (const auto size : sizes) {
        std::string text(size, ' ');
        for (size_t place = 0; place < size; ++place) {
            text[place] = static_cast<char>('a' + (place * 7 + size) % 26);
        }
        Bytes value = encoded(text);
        SampleInfo info;
        if (!said->write(&value)) {
            throw std::runtime_error("a value cannot be sent");
        }
        const auto again = next(heard, info);
        if (!again || std::get<0>(decoded<std::string>(*again)) != text) {
            throw std::runtime_error("not heard again: " + std::to_string(size));
        }
    }
    std::cout << "heard " << sizes.size() << std::endl;
}

void ask(Node &node) {
    const auto answered = [](std::optional<Bytes> response) {
        if (!response) {
            throw std::runtime_error("no response");
        }
        return *response;
    };
    Client add(node, "Interop/add", "example_interfaces::srv::dds_::AddTwoInts");
    for (int64_t number = 0; number < 200; ++number) {
        const auto [sum] = decoded<int64_t>(answered(add.call(encoded(int64_t{1} << 40, -number))));
        if (sum != (int64_t{1} << 40) - number) {
            throw std::runtime_error("a wrong sum: " + std::to_string(sum));
        }
    }
    std::cout << "added 200" << std::endl;
    // A report without marks: number, text, data, ranges, kind, origin, marks, scores; and by how much they are moved.
    Client shift(node, "Interop/shift", "interop_msgs::srv::dds_::InteropShift");
    const std::vector<uint8_t> none;
    const uint32_t no = 0;
    size_t refused = 0;
    for (const size_t begin : {0, 500, 900}) {
        for (size_t size = begin; size < begin + 8; ++size) {
            const std::string text(size, 'b');
            auto bare = encoded(int64_t{1}, text, none, no, int32_t{0}, 0.0F, 0.0, no, no, 0.5);
            const auto [code, what, number] =
                decoded<int32_t, std::string, int32_t>(answered(shift.call(bare)));
            refused += code == 1 && what == "`" + text + "` has no marks" && number == -7;
        }
    }
    std::cout << "refused " << refused << std::endl;
    // An empty message has one byte in it.
    Client note(node, "Interop/note", "interop_msgs::srv::dds_::InteropNote");
    Client noted(node, "Interop/noted", "interop_msgs::srv::dds_::InteropNoted");
    answered(note.call(encoded(std::string("from Fast DDS"))));
    const auto [notes] = decoded<std::vector<std::string>>(answered(noted.call(encoded(uint8_t{0}))));
    std::cout << "noted " << notes.size() << ": " << notes.front() << std::endl;
    for (const size_t size : {1021, 2051, 204'801, 1 << 20}) {
        answered(note.call(encoded(std::string(size, 'x'))));
    }
    std::cout << "noted long ones" << std::endl;
    // All of them, in many fragments.
    const bool is_large = noted.call(encoded(uint8_t{0}), std::chrono::seconds(20)).has_value();
    std::cout << (is_large ? "a large response" : "no large response") << std::endl;
}

void oracle(Node &node) {
    Server asks(node, "Oracle/ask", "interop_msgs::srv::dds_::OracleAsk");
    Server tells(node, "Oracle/tell", "interop_msgs::srv::dds_::OracleTell");
    asks.met();
    tells.met();
    std::cout << "ready" << std::endl;
    std::thread([] {
        std::string line;
        while (std::getline(std::cin, line)) {
        }
        std::_Exit(0);
    }).detach();
    // Response: code, nonsense, place, result.
    const auto answer = [](Bytes request) -> std::optional<Bytes> {
        const auto [question] = decoded<std::string>(std::move(request));
        std::cout << "asked " << question << std::endl;
        if (question == "hold") {
            return std::nullopt;
        }
        if (question == "nonsense") {
            return encoded(int32_t{1}, std::string("so it is"), int32_t{9}, 0.0F, 0.0, int64_t{0});
        }
        return encoded(int32_t{0}, std::string(), int32_t{0}, 1.5F, -2.5, int64_t{1} << 40);
    };
    while (true) {
        asks.serve(answer);
        tells.serve([](Bytes request) {
            std::cout << "told " << std::get<0>(decoded<std::string>(std::move(request))) << std::endl;
            return encoded(uint8_t{0});
        });
    }
}

int main(int count, char **given) try {
    const std::vector<std::string> args(given + 1, given + count);
    if (args.size() < 3) {
        throw std::runtime_error("usage: fast NETWORK DOMAIN talk|ask|oracle [BYTES...]");
    }
    Node node(args[0], std::stoul(args[1]));
    if (args[2] == "talk") {
        std::vector<size_t> sizes;
        for (size_t place = 3; place < args.size(); ++place) {
            sizes.push_back(std::stoul(args[place]));
        }
        talk(node, sizes);
    } else if (args[2] == "ask") {
        ask(node);
    } else {
        oracle(node);
    }
    return 0;
} catch (const std::exception &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
